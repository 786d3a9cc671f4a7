#include "model/registry.h"

namespace mbcosim {

std::string normalized(std::string_view word) {
  std::string r;
  r.reserve(word.size());
  for (const char c : word)
    if (c != ' ' && (c < '\t' || c > '\r'))
      r += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return r;
}

namespace {

template <class Value>
void enter(WordTable<Value>& table, std::initializer_list<std::string_view> words,
           const Value& value) {
  for (const std::string_view word : words) table.add(word, value);
}

}  // namespace

Registry::Head& Registry::head(std::string_view word, Family family) {
  Head& head = heads[normalized(word)];
  head.word = word;
  head.family = family;
  return head;
}

void Registry::element(std::string_view head, Family family, ElementReader reader, bool has_label) {
  Head& h = this->head(head, family);
  h.has_label = has_label;
  h.reader = std::move(reader);
}

void Registry::typed(std::string_view head, Family family,
                     std::initializer_list<std::string_view> words, ElementReader reader) {
  enter(this->head(head, family).types, words, reader);
}

void Registry::drive(std::initializer_list<std::string_view> words, DriveReader reader) {
  enter(drives, words, reader);
}
void Registry::law1(std::initializer_list<std::string_view> words, LawReader<1> reader) {
  enter(laws1, words, reader);
}
void Registry::law3(std::initializer_list<std::string_view> words, LawReader<3> reader) {
  enter(laws3, words, reader);
}
void Registry::law6(std::initializer_list<std::string_view> words, LawReader<6> reader) {
  enter(laws6, words, reader);
}
void Registry::function(std::initializer_list<std::string_view> words, FunctionReader reader) {
  enter(functions, words, reader);
}
void Registry::fluid(std::initializer_list<std::string_view> words, FluidReader reader) {
  enter(fluids, words, reader);
}
void Registry::file_driver(std::initializer_list<std::string_view> words, FileDriverReader reader) {
  enter(file_drivers, words, reader);
}

void Registry::unsupported(std::string_view context, std::string_view word, std::string_view what) {
  not_supported[std::string(context)].add(word, what);
}

}  // namespace mbcosim
