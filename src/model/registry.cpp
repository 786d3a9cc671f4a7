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

template <class Words, class Table, class Reader>
void enter(std::map<std::string, std::string>& display, Table& table, const Words& words,
           const Reader& reader) {
  for (const auto word : words) {
    const std::string key = normalized(word);
    table[key] = reader;
    display[key] = std::string(word);
  }
}

}  // namespace

void Registry::element(std::string_view head, Family family, ElementReader reader, bool has_label) {
  const std::string key = normalized(head);
  Head& h = heads[key];
  h.family = family;
  h.has_label = has_label;
  h.reader = std::move(reader);
  display[key] = std::string(head);
}

void Registry::typed(std::string_view head, Family family,
                     std::initializer_list<std::string_view> words, ElementReader reader) {
  const std::string key = normalized(head);
  Head& h = heads[key];
  h.family = family;
  display[key] = std::string(head);
  enter(display, h.types, words, reader);
}

void Registry::drive(std::initializer_list<std::string_view> words, DriveReader reader) {
  enter(display, drives, words, reader);
}
void Registry::law1(std::initializer_list<std::string_view> words, LawReader<1> reader) {
  enter(display, laws1, words, reader);
}
void Registry::law3(std::initializer_list<std::string_view> words, LawReader<3> reader) {
  enter(display, laws3, words, reader);
}
void Registry::law6(std::initializer_list<std::string_view> words, LawReader<6> reader) {
  enter(display, laws6, words, reader);
}
void Registry::function(std::initializer_list<std::string_view> words, FunctionReader reader) {
  enter(display, functions, words, reader);
}
void Registry::fluid(std::initializer_list<std::string_view> words, FluidReader reader) {
  enter(display, fluids, words, reader);
}

void Registry::file_driver(std::initializer_list<std::string_view> words, FileDriverReader reader) {
  enter(display, file_drivers, words, reader);
}

void Registry::unsupported(std::string_view context, std::string_view word, std::string_view what) {
  const std::string key = normalized(word);
  not_supported[std::string(context)][key] = std::string(what);
  display[key] = std::string(word);
}

}  // namespace mbcosim
