#include "service/model_description.h"

#include <charconv>
#include <string>
#include <string_view>
#include <unordered_map>

#include "model/model_part.h"
#include "service/reply_pages.h"
#include "wire/convert.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

/// Which entries of a list belong to a page: those after the number that its token tells.
class Page {
 public:
  explicit Page(const v1::DescribeSimulationRequest& request)
      : size_(page_size_of(request, kMost, kMost)) {
    const std::string& token = request.page_token();
    const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), first_);
    if (!token.empty() &&
        (error != std::errc() || end != token.data() + token.size() || first_ <= 0))
      throw Refusal(v1::REASON_BAD_ARGUMENT, "`page_token` is not one of the server's");
  }
  /// Whether the next entry belongs to the page.
  bool takes() {
    const bool inside = at_ >= first_ && at_ - first_ < size_;
    ++at_;
    return inside;
  }
  void close(v1::DescribeSimulationReply* out) const {
    if (at_ - first_ > size_) out->set_next_page_token(std::to_string(first_ + size_));
  }

 private:
  static constexpr std::int64_t kMost = 5000;
  const std::int64_t size_;
  std::int64_t first_ = 0, at_ = 0;
};

void describe_variables(const Described& described, const v1::DescribeSimulationRequest& request,
                        v1::ModelDescription* out) {
  const std::vector<Variable>& variables = described.variables;
  std::unordered_map<std::string_view, int> handles;
  constexpr std::size_t kMostRepeated = 10'000;
  const auto names = static_cast<std::size_t>(request.variable_names_size());
  if (names > variables.size() + kMostRepeated)
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`variable_names` has " + std::to_string(names) +
                                               " names; the model has " +
                                               std::to_string(variables.size()) + " variables");
  for (const std::string& name : request.variable_names()) handles.emplace(name, -1);
  for (std::size_t i = 0; i < variables.size(); ++i)
    if (const auto wanted = handles.find(variables[i].name); wanted != handles.end())
      wanted->second = static_cast<int>(i);
  const UnitSystem* units = find_part<UnitSystem>(described.model);
  for (const std::string& name : request.variable_names()) {
    const int handle = handles.at(name);
    const std::string shown = utf8(name.substr(0, 100));
    if (handle < 0)
      throw Refusal(v1::REASON_NO_SUCH_VARIABLE, "no variable is named \"" + shown + "\"",
                    {{"name", shown}});
    to_proto(variables[handle], handle, units, out->add_variables());
  }
}

}  // namespace

void describe(const Described& described, const v1::DescribeSimulationRequest& request,
              v1::DescribeSimulationReply* reply) {
  const auto& [model, variables, symbols, ports] = described;
  v1::ModelDescription* out = reply->mutable_model();
  to_proto(model, out);
  if (request.variable_names_size() > 0) return describe_variables(described, request, out);
  const bool first = request.page_token().empty();
  Page page(request);
  for (int k = 0; k < node_count(model); ++k)
    if (page.takes()) to_proto(model, k, out->add_nodes());
  for (const ElementRef& e : model.elements)
    if (page.takes()) to_proto(model, e, out->add_elements());
  const std::string& prefix = request.variable_prefix();
  const UnitSystem* units = find_part<UnitSystem>(model);
  for (std::size_t i = 0; i < variables.size(); ++i)
    if (variables[i].name.compare(0, prefix.size(), prefix) == 0 && page.takes())
      to_proto(variables[i], static_cast<int>(i), units, out->add_variables());
  page.close(reply);
  if (!first) return;
  for (const DeckSymbol& symbol : symbols) to_proto(symbol, out->add_symbols());
  for (const auto& port : ports) port->fill(out->add_ports());
}

}  // namespace mbcosim::server
