#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "elements/families.h"
#include "input/grammar/grammar.h"
#include "input/vocabulary.h"

namespace mbcosim::cli {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const VocabularyWord& word) {
  Json json = {{"word", word.word}, {"served", word.served}, {"support", word.support}};
  if (!word.note.empty()) json["note"] = word.note;
  if (!word.reason.empty()) {
    json["dead"] = word.dead;
    json["reason"] = word.reason;
  }
  if (!word.sizes.empty()) json["sizes"] = word.sizes;
  if (!word.form.empty()) json["form"] = word.form;
  if (!word.grammar.empty()) json["grammar"] = word.grammar;
  Json units = Json::object();
  for (const GrammarArgument& argument : grammar_arguments(word.grammar))
    units[argument.name] = argument.unit;
  if (!units.empty()) json["units"] = units;
  if (!word.output.empty()) json["output"] = word.output;
  return json;
}

/// [{"name": "joint", "title": "Joints", "form": "joint : <label> , <word> , …", "words": [{"word":
/// "clamp", "served": true, "support": "yes", "grammar": "<length [m]> , …", "units": {"length":
/// "m"}, "output": ".jnt: …"},
/// {"word": "gravity", "form": "gravity : <grammar> ;", …},
/// {"word": "rotation", "served": false, "support": "dead", "dead": true, "reason": "…"}]}]
Json to_json(const std::vector<VocabularyGroup>& groups) {
  Json list = Json::array();
  for (const VocabularyGroup& group : groups) {
    Json words = Json::array();
    for (const VocabularyWord& word : group.words) words.push_back(to_json(word));
    Json json = {{"name", group.name}, {"title", group.title}};
    if (!group.form.empty()) json["form"] = group.form;
    json["words"] = words;
    list.push_back(json);
  }
  return list;
}

void print(const std::vector<VocabularyGroup>& groups) {
  for (const VocabularyGroup& group : groups) {
    std::printf("%s\n", group.name.c_str());
    for (const VocabularyWord& word : group.words) {
      std::printf("  %s%s\n", word.word.c_str(),
                  word.served ? ""
                  : word.dead ? "  (dead)"
                              : "  (not supported)");
    }
  }
}

}  // namespace

int keywords(bool json) {
  const std::vector<VocabularyGroup> groups = vocabulary(full_registry());
  if (json) {
    std::printf("%s\n", to_json(groups).dump(1).c_str());
  } else {
    print(groups);
  }
  return kDone;
}

}  // namespace mbcosim::cli
