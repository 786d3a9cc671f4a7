#include "service/auth.h"

#include <fstream>
#include <sstream>
#include <stdexcept>

#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

Role role_of(const std::string& name, int line) {
  for (const Role role : {Role::observe, Role::control, Role::admin})
    if (name == role_name(role)) return role;
  throw std::runtime_error("tokens file, line " + std::to_string(line) + ": role \"" + name +
                           "\" is none of observe, control, admin");
}

}  // namespace

bool same_text(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  unsigned char difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) difference |= static_cast<unsigned char>(a[i] ^ b[i]);
  return difference == 0;
}

const char* role_name(Role role) {
  constexpr const char* kNames[] = {"observe", "control", "admin"};
  return kNames[static_cast<int>(role)];
}

Authenticator Authenticator::from_file(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot read the tokens file");
  Authenticator result;
  result.tokens_required_ = true;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    std::istringstream words(line.substr(0, line.find('#')));
    Token token;
    std::string role;
    if (!(words >> token.text)) continue;
    if (!(words >> role >> token.caller.identity))
      throw std::runtime_error("tokens file, line " + std::to_string(number) +
                               ": expected TOKEN ROLE IDENTITY [EXPIRY]");
    token.caller.role = role_of(role, number);
    words >> token.expiry;
    result.tokens_.push_back(std::move(token));
  }
  return result;
}

const Authenticator::Token* Authenticator::find(const std::string& text) const {
  const Token* found = nullptr;
  for (const Token& token : tokens_)
    if (same_text(token.text, text)) found = &token;
  return found;
}

Caller Authenticator::caller_of(const std::string& authorization) const {
  constexpr const char* kScheme = "Bearer ";
  if (authorization.rfind(kScheme, 0) != 0)
    throw Refusal(v1::REASON_UNAUTHENTICATED, "a bearer token is required");
  const Token* token = find(authorization.substr(std::string(kScheme).size()));
  if (!token) throw Refusal(v1::REASON_UNAUTHENTICATED, "unknown bearer token");
  if (token->expiry != 0 && token->expiry < std::time(nullptr))
    throw Refusal(v1::REASON_UNAUTHENTICATED, "the bearer token has expired");
  return token->caller;
}

const Caller& Authenticator::require(const Caller& caller, Role required) {
  if (caller.role >= required) return caller;
  throw Refusal(v1::REASON_ROLE_TOO_LOW, std::string("the call needs role ") + role_name(required) +
                                             ", the caller has " + role_name(caller.role));
}

Caller Authenticator::check(const grpc::ServerContext& context, Role required) const {
  const auto auth = context.auth_context();
  if (tokens_required_) {
    const auto& metadata = context.client_metadata();
    const auto header = metadata.find("authorization");
    return require(caller_of(header == metadata.end()
                                 ? ""
                                 : std::string(header->second.data(), header->second.size())),
                   required);
  }
  Caller caller{"local", Role::admin};
  if (auth && auth->IsPeerAuthenticated()) {
    const auto names = auth->FindPropertyValues("x509_common_name");
    if (!names.empty()) caller = {std::string(names[0].data(), names[0].size()), Role::control};
  }
  return require(caller, required);
}

Caller Authenticator::check_local(const std::string& authorization, Role required) const {
  return require(tokens_required_ ? caller_of(authorization) : Caller{"local", Role::admin},
                 required);
}

}  // namespace mbcosim::server
