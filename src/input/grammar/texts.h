/// The grammar of the words, as text; `grammar.h` has its form.
#pragma once

namespace mbcosim::grammar {

extern const char* const kBlocks;
extern const char* const kControl;
extern const char* const kNodes;
extern const char* const kElements;
extern const char* const kJoints;
extern const char* const kObjects;
extern const char* const kNotation;

}  // namespace mbcosim::grammar
