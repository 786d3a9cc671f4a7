#include "service/grants.h"

#include <algorithm>
#include <string_view>

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

Grants::Grants(std::string owner, const List& grants) : owner_(std::move(owner)), grants_(grants) {
  check(grants);
}

void Grants::replace(const List& grants) {
  check(grants);
  Guard guard(mutex_);
  grants_ = grants;
}

bool Grants::allow(const Caller& caller, Access access, const std::string& port) const {
  if (caller.may_touch(owner_)) return true;
  Guard guard(mutex_);
  return std::any_of(grants_.begin(), grants_.end(), [&](const v1::Grant& grant) {
    return (grant.identity() == "*" || grant.identity() == caller.identity) &&
           gives(grant, access, port);
  });
}

Grants::List Grants::list() const {
  Guard guard(mutex_);
  return grants_;
}

}  // namespace mbcosim::server
