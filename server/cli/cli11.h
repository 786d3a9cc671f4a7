/// CLI11, in a program that is not to set up the standard streams before it is known to use them.
#pragma once

#include <istream>
#include <ostream>

#ifdef __GLIBCXX__
// Whoever includes libstdc++'s <iostream> has the streams and all facets of their locale made
// before `main`: as much as reading a small deck takes. Declared here, they are made on request.
#define _GLIBCXX_IOSTREAM 1
namespace std {
extern istream cin;
extern ostream cout, cerr, clog;
}  // namespace std
#endif
#include <CLI/CLI.hpp>

namespace mbcosim::cli {

/// Before anything of CLI11 is used.
inline void open_streams() { static const std::ios_base::Init streams; }

}  // namespace mbcosim::cli
