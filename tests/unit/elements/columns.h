/// Output rows of elements as numbers.
#pragma once

#include <string_view>
#include <vector>

#include "model/output_row.h"

namespace mbcosim::decks {

/// What an element prints, as numbers.
class Columns : public OutputRow {
 public:
  void begin(OutputFile f, int l) override { file = f, label = l; }
  void begin_text(OutputFile f, std::string_view) override { file = f; }
  void integer(int value) override { v.push_back(value); }
  void scalar(const char*, const char*, double value) override { v.push_back(value); }
  void vec3(const char*, const char*, const Vec3& x) override {
    v.insert(v.end(), x.data(), x.data() + 3);
  }
  void values(const char*, const char*, const double* data, int count) override {
    v.insert(v.end(), data, data + count);
  }
  void end() override {}
  OutputFile file = OutputFile::count;
  int label = -1;
  std::vector<double> v;
};

}  // namespace mbcosim::decks
