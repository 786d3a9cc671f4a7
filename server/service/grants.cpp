#include "service/grants.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

constexpr int kMostGrants = 1000, kMostPorts = 1000;  // ports of all grants together
constexpr std::size_t kLongestIdentity = 1000;

/// "*", "local", "token:NAME" or "cert:…".
bool is_identity(const std::string& text) {
  if (text == "*" || text == "local") return true;
  if (text.size() > kLongestIdentity) return false;
  for (const std::string_view kind : {"token:", "cert:"})
    if (text.size() > kind.size() && text.compare(0, kind.size(), kind) == 0) return true;
  return false;
}

bool gives(const v1::Grant& grant, Access access, const std::string& port) {
  const bool control = grant.right() == v1::RIGHT_CONTROL;
  switch (access) {
    case Access::see:
      return true;
    case Access::observe:
      return control || grant.right() == v1::RIGHT_OBSERVE;
    case Access::couple:
      return control ||
             (grant.right() == v1::RIGHT_COUPLE &&
              (grant.ports().empty() ||
               std::find(grant.ports().begin(), grant.ports().end(), port) != grant.ports().end()));
    case Access::control:
      return control;
    case Access::own:
      return false;
  }
  return false;
}

std::size_t size_of(const std::string& owner, const Grants::List& grants) {
  std::size_t bytes = sizeof(Rights) + owner.size();
  for (const v1::Grant& grant : grants) bytes += grant.SpaceUsedLong();
  return bytes;
}

}  // namespace

void Grants::check(const List& grants) {
  if (grants.size() > kMostGrants)
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "`grants` must not have more than " + std::to_string(kMostGrants) + " entries");
  int ports = 0;
  for (const v1::Grant& grant : grants) {
    ports += grant.ports_size();
    if (ports > kMostPorts)
      throw Refusal(v1::REASON_BAD_ARGUMENT, "`grants.ports` must not have more than " +
                                                 std::to_string(kMostPorts) +
                                                 " entries in all grants");
    if (!is_identity(grant.identity()))
      throw Refusal(
          v1::REASON_BAD_ARGUMENT,
          "`grants.identity` must be \"*\" or an identity such as \"token:NAME\", got \"" +
              grant.identity().substr(0, 100) + "\"");
    if (!v1::Right_IsValid(grant.right()) || grant.right() == v1::RIGHT_UNSPECIFIED)
      throw Refusal(
          v1::REASON_BAD_ARGUMENT,
          "`grants.right` must be OBSERVE, COUPLE or CONTROL for \"" + grant.identity() + "\"");
    if (grant.ports_size() > 0 && grant.right() != v1::RIGHT_COUPLE)
      throw Refusal(v1::REASON_BAD_ARGUMENT, "`grants.ports` goes with the right COUPLE only");
  }
}

void Grants::check_known(const List& grants, const Authenticator& authenticator) {
  for (const v1::Grant& grant : grants)
    if (!authenticator.may_be_known(grant.identity()))
      throw Refusal(v1::REASON_BAD_ARGUMENT, "`grants.identity`: the server has no token named \"" +
                                                 grant.identity().substr(0, 100) + "\"");
}

Rights::Rights(std::string owner, List grants)
    : owner_(std::move(owner)), grants_(std::move(grants)), bytes_(size_of(owner_, grants_)) {}

bool Rights::allow(const Caller& caller, Access access, const std::string& port) const {
  return caller.may_touch(owner_) ||
         std::any_of(grants_.begin(), grants_.end(), [&](const v1::Grant& grant) {
           return (grant.identity() == "*" || grant.identity() == caller.identity) &&
                  gives(grant, access, port);
         });
}

void refuse_unknown(const std::string& id) {
  throw Refusal(v1::REASON_NO_SUCH_SIMULATION,
                "no simulation is named \"" + id.substr(0, 100) + "\"");
}

void Rights::require(const std::string& id, const Caller& caller, Access access,
                     const std::string& port) const {
  if (allow(caller, access, port)) return;
  if (!allow(caller, Access::see)) refuse_unknown(id);
  constexpr const char* kNames[] = {"see", "observe", "couple", "control", "own"};
  const std::string name = kNames[static_cast<int>(access)];
  throw Refusal(v1::REASON_NOT_GRANTED,
                "no grant of " + id + " lets the caller " + name +
                    (port.empty() ? "" : " at port \"" + port.substr(0, 100) + "\"") +
                    "; its owner gives them (`grants`)",
                {{"wanted", name}});
}

Grants::Grants(std::string owner, const List& grants) : owner_(std::move(owner)) {
  replace(grants);
}

void Grants::replace(const List& grants) {
  check(grants);
  auto rights = std::make_shared<const Rights>(owner_, grants);
  Guard guard(mutex_);
  rights_.swap(rights);
}

RightsPtr Grants::now() const {
  Guard guard(mutex_);
  return rights_;
}

}  // namespace mbcosim::server
