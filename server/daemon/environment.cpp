#include "daemon/environment.h"

#include <algorithm>
#include <cctype>
#include <cstring>
#include <regex>

#include "input/nearest.h"

namespace mbcosim::server {
namespace {

constexpr const char* kPrefix = "MBCOSIMD_";

std::string name_of(const char* entry) { return {entry, std::strcspn(entry, "=")}; }

/// Every pod has the addresses of its namespace's services: `MBCOSIMD_SERVICE_HOST`,
/// `MBCOSIMD_PORT_50051_TCP_ADDR`.
bool is_of_kubernetes(const std::string& name) {
  static const std::regex service(
      "MBCOSIMD(_[A-Z0-9_]+)?_(SERVICE_HOST|SERVICE_PORT(_[A-Z0-9_]+)?|"
      "PORT(_[0-9]+_(TCP|UDP|SCTP)(_(PROTO|PORT|ADDR))?)?)");
  return std::regex_match(name, service);
}

std::string complaint(const std::string& name, const std::vector<std::string>& options) {
  const std::size_t prefix = std::strlen(kPrefix);
  Nearest nearest(name.substr(prefix));
  for (const std::string& option : options) nearest.consider(variable_of(option).substr(prefix));
  std::string text = "the environment variable " + name + " is no option";
  for (const std::string& option : options)
    if (!nearest.best().empty() && variable_of(option) == kPrefix + nearest.best())
      return text + "; did you mean " + variable_of(option) + " (--" + option + ")?";
  return text + "; `mbcosimd --help` lists them";
}

}  // namespace

std::string variable_of(const std::string& option) {
  std::string variable = kPrefix;
  for (const char c : option)
    variable += c == '-' ? '_' : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return variable;
}

std::vector<std::string> stray_variables(const std::vector<std::string>& options,
                                         const char* const* environment) {
  std::vector<std::string> names, complaints;
  for (; *environment; ++environment) names.push_back(name_of(*environment));
  const bool in_pod = std::count(names.begin(), names.end(), "KUBERNETES_SERVICE_HOST") > 0;
  for (const std::string& name : names) {
    const bool is_option =
        std::any_of(options.begin(), options.end(),
                    [&](const std::string& option) { return variable_of(option) == name; });
    if (name.rfind(kPrefix, 0) != 0 || is_option || (in_pod && is_of_kubernetes(name))) continue;
    complaints.push_back(complaint(name, options));
  }
  return complaints;
}

}  // namespace mbcosim::server
