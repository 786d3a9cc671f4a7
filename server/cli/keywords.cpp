#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "elements/families.h"
#include "input/vocabulary.h"

namespace mbcosim::cli {
namespace {

using Json = nlohmann::ordered_json;

/// [{"name": "joint", "title": "Joints", "words": [{"word": "clamp", "served": true}, {"word":
/// "rotation", "served": false, "dead": true, "reason": "…"}]}]
Json to_json(const std::vector<VocabularyGroup>& groups) {
  Json list = Json::array();
  for (const VocabularyGroup& group : groups) {
    Json words = Json::array();
    for (const VocabularyWord& word : group.words) {
      words.push_back({{"word", word.word}, {"served", word.served}});
      if (!word.reason.empty()) {
        words.back()["dead"] = word.dead;
        words.back()["reason"] = word.reason;
      }
      if (!word.sizes.empty()) words.back()["sizes"] = word.sizes;
    }
    list.push_back({{"name", group.name}, {"title", group.title}, {"words", words}});
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
