#include "rpc/auth.h"

#include <grpc/grpc_security_constants.h>
#include <openssl/crypto.h>
#include <openssl/sha.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "files/trusted_file.h"
#include "wire/convert.h"
#include "wire/metadata.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

constexpr std::string_view kHash = "sha256:", kToken = "token:";

[[noreturn]] void refuse_line(int line, const std::string& what) {
  throw std::runtime_error("tokens file, line " + std::to_string(line) + ": " + what);
}

Role role_of(const std::string& name, int line) {
  if (const auto role = role_named(name)) return *role;
  refuse_line(line, "role \"" + name + "\" is none of observe, control, admin");
}

/// "2027-01-31" → its end in UTC; Unix seconds.
std::time_t time_of(const std::string& text, int line) {
  std::int64_t seconds = 0;
  const char* last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, seconds);
  if (error == std::errc() && end == last && seconds > 0) return static_cast<std::time_t>(seconds);
  std::tm day{};
  const char* rest = ::strptime(text.c_str(), "%Y-%m-%d", &day);
  const std::tm asked = day;
  if (rest && *rest == '\0' && text.size() == 10) {
    const std::time_t start = ::timegm(&day);
    if (day.tm_mday == asked.tm_mday && day.tm_mon == asked.tm_mon) return start + 24 * 3600 - 1;
  }
  refuse_line(line, "\"" + text + "\" is no date; an expiry is YYYY-MM-DD or Unix seconds");
}

bool is_hash(const std::string& text) {
  return text.compare(0, kHash.size(), kHash) == 0 &&
         text.size() == kHash.size() + 2 * SHA256_DIGEST_LENGTH &&
         text.find_first_not_of("0123456789abcdef", kHash.size()) == std::string::npos;
}

}  // namespace

bool same_text(const std::string& a, const std::string& b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

std::string hash_of_token(const std::string& token) {
  unsigned char digest[SHA256_DIGEST_LENGTH];
  SHA256(reinterpret_cast<const unsigned char*>(token.data()), token.size(), digest);
  std::string text(kHash);
  constexpr const char* kDigits = "0123456789abcdef";
  for (const unsigned char byte : digest) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

const char* role_name(Role role) {
  constexpr const char* kNames[] = {"observe", "control", "admin"};
  return kNames[static_cast<int>(role)];
}

std::optional<Role> role_named(const std::string& name) {
  for (const Role role : {Role::observe, Role::control, Role::admin})
    if (name == role_name(role)) return role;
  return std::nullopt;
}

// ------------------------------------------------------------------ the file

Authenticator Authenticator::from_file(const std::string& path) {
  Authenticator result;
  result.tokens_required_ = true;
  result.reload(path);
  return result;
}

void Authenticator::reload(const std::string& path) {
  auto tokens = std::make_shared<const Tokens>(read(path));
  Guard guard(store_->mutex);
  store_->tokens = std::move(tokens);
}

Authenticator::Tokens Authenticator::read(const std::string& path) {
  check_trusted("the tokens file", path);
  std::ifstream file(path);
  if (!file || std::filesystem::is_directory(path))
    throw std::runtime_error("cannot read the tokens file " + path + ": " +
                             (file ? "it is a folder" : std::strerror(errno)));
  Tokens result;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    line = line.substr(0, line.find('#'));
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    Token token = read_token(line, number);
    if (std::any_of(result.begin(), result.end(),
                    [&](const Token& other) { return other.hash == token.hash; }))
      refuse_line(number, "the token stands in an earlier line already");
    result.push_back(std::move(token));
  }
  return result;
}

Authenticator::Token Authenticator::read_token(const std::string& line, int number) {
  std::istringstream words(line);
  std::string text, role, name, expiry, more;
  if (!(words >> text >> role >> name)) refuse_line(number, "expected TOKEN ROLE NAME [EXPIRY]");
  Token token;
  const bool hashed = text.compare(0, kHash.size(), kHash) == 0;
  if (hashed && !is_hash(text))
    refuse_line(number, "after \"sha256:\" there must be 64 hexadecimal digits");
  if (!is_metadata(text))
    refuse_line(number, "a token has printable ASCII characters only: no call can carry others");
  if (name != utf8(name)) refuse_line(number, "the name is not UTF-8, as the service's texts are");
  token.hash = hashed ? text : hash_of_token(text);
  token.caller = {std::string(kToken) + name, role_of(role, number)};
  if (words >> expiry) token.expiry = time_of(expiry, number);
  if (words >> more) refuse_line(number, "nothing is expected after the expiry");
  return token;
}

// ------------------------------------------------------------------ calls

std::shared_ptr<const Authenticator::Tokens> Authenticator::tokens() const {
  Guard guard(store_->mutex);
  return store_->tokens;
}

bool Authenticator::may_be_known(const std::string& identity) const {
  if (!tokens_required_ || identity.compare(0, kToken.size(), kToken) != 0) return true;
  const auto all = tokens();
  return std::any_of(all->begin(), all->end(),
                     [&](const Token& token) { return token.caller.identity == identity; });
}

std::optional<Authenticator::Token> Authenticator::find(const std::string& text) const {
  const auto all = tokens();
  const std::string hash = hash_of_token(text);
  const Token* found = nullptr;
  for (const Token& token : *all)  // all of them, so that the time tells nothing
    if (same_text(token.hash, hash)) found = &token;
  return found ? std::optional(*found) : std::nullopt;
}

Caller Authenticator::caller_of(const std::string& authorization) const {
  if (!is_bearer(authorization))
    throw Refusal(v1::REASON_UNAUTHENTICATED, "a bearer token is required");
  const std::optional<Token> token = find(authorization.substr(kBearer.size()));
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

namespace {

/// Of a client certificate that gRPC has verified.
std::string identity_of(const grpc::AuthContext& auth) {
  for (const char* property : {GRPC_PEER_URI_PROPERTY_NAME, GRPC_X509_SUBJECT_PROPERTY_NAME}) {
    const auto values = auth.FindPropertyValues(property);
    if (!values.empty() && !values.front().empty())
      return "cert:" + std::string(values.front().data(), values.front().size());
  }
  throw Refusal(v1::REASON_UNAUTHENTICATED,
                "the client's certificate has neither a URI among its names nor a subject");
}

}  // namespace

Caller Authenticator::check(const grpc::ServerContextBase& context, Role required) const {
  const auto auth = context.auth_context();
  if (tokens_required_) {
    const auto& metadata = context.client_metadata();
    const auto header = metadata.find("authorization");
    return require(caller_of(header == metadata.end()
                                 ? ""
                                 : std::string(header->second.data(), header->second.size())),
                   required);
  }
  if (auth && auth->IsPeerAuthenticated()) {
    const std::string identity = identity_of(*auth);
    const auto given = certificate_roles_.find(identity);
    return require({identity, given == certificate_roles_.end() ? Role::control : given->second},
                   required);
  }
  return require({"local", Role::admin}, required);
}

Caller Authenticator::check_local(const std::string& authorization, Role required) const {
  return require(tokens_required_ ? caller_of(authorization) : Caller{"local", Role::admin},
                 required);
}

}  // namespace mbcosim::server
