#include "output/sample_files.h"

#include <cstdio>

namespace mbcosim {

namespace {

std::vector<SampledTable> tables_of(const Model& model) {
  std::vector<SampledTable> all;
  for (const auto& set : model.sets) {
    const auto* source = dynamic_cast<const SampledTableSource*>(set.get());
    if (!source) continue;
    for (SampledTable& table : source->sampled_tables()) all.push_back(std::move(table));
  }
  return all;
}

std::string path_of(const SampledTable& table, const std::string& prefix) {
  return prefix + "." + table.file;
}

}  // namespace

std::vector<std::string> sample_paths(const Model& model, const std::string& prefix) {
  std::vector<std::string> paths;
  for (const SampledTable& table : tables_of(model)) paths.push_back(path_of(table, prefix));
  return paths;
}

void SampleFiles::open(const Model& model, const std::string& prefix, ResultBudget* budget) {
  for (SampledTable& table : tables_of(model)) {
    auto t = std::make_unique<Table>();
    t->file.open(path_of(table, prefix), budget);
    t->source = std::move(table);
    tables_.push_back(std::move(t));
  }
}

void SampleFiles::write(const State& state) {
  for (const auto& table : tables_) {
    const double samples = state.memory[table->source.samples];
    if (samples == table->written) continue;
    table->written = samples;
    const double* row = &state.memory[table->source.first];
    for (int k = 0; k < table->source.count; ++k) {
      constexpr int kField = 40;
      char* p = table->file.room(kField);
      table->file.commit(p + std::snprintf(p, kField, "%16g", row[k]));
    }
    table->file.text("\n");
  }
}

void SampleFiles::go_back(const State& state) {
  for (const auto& table : tables_) table->written = state.memory[table->source.samples];
}

}  // namespace mbcosim
