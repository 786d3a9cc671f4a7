/// Who calls, and what they may do.
#pragma once

#include <grpcpp/server_context.h>

#include <ctime>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "threads/mutex.h"

namespace mbcosim::server {

enum class Role { observe, control, admin };
const char* role_name(Role role);
std::optional<Role> role_named(const std::string& name);

/// Whether two secrets are equal, in a time that does not tell where they differ.
bool same_text(const std::string& a, const std::string& b);

/// How a token is kept: "sha256:" and 64 hexadecimal digits. Tokens are long and random, so a quick
/// hash without salt tells nobody what they are.
std::string hash_of_token(const std::string& token);

/// One form for all who call: "local", "token:NAME", "cert:" and the first URI among the
/// alternative names of a certificate, else its subject as in RFC 4514. Never empty.
struct Caller {
  std::string identity;
  Role role = Role::observe;
  bool may_touch(const std::string& owner) const {
    return role == Role::admin || identity == owner;
  }
};

/// Knows the tokens. Without tokens and without client certificates every caller is "local" with
/// role admin: the Unix socket's mode decides who can connect.
class Authenticator {
 public:
  /// Reads lines `TOKEN ROLE NAME [EXPIRY]`, the token itself or its hash; `#` starts a comment.
  /// EXPIRY: "2027-01-31", the last day in UTC, or Unix seconds. Throws std::runtime_error that
  /// names the line, or tells that others may write the file or replace it (check_trusted).
  static Authenticator from_file(const std::string& path);
  Authenticator() = default;
  /// Roles of client certificates by identity, "cert:…"; the others have control.
  void set_certificate_roles(std::map<std::string, Role> roles) {
    certificate_roles_ = std::move(roles);
  }
  /// Takes the tokens of the file in the place of those before; calls at work go on. Throws as
  /// `from_file`, and nothing changes. Thread-safe, as all else.
  void reload(const std::string& path);

  /// Throws Refusal: UNAUTHENTICATED, or PERMISSION_DENIED when the role is below `required`.
  Caller check(const grpc::ServerContextBase& context, Role required) const;
  /// The same for a caller on this host that gRPC does not know: `authorization` is "Bearer TOKEN".
  Caller check_local(const std::string& authorization, Role required) const;
  /// Whether a "token:NAME" has a line in the file; all else may be somebody.
  bool may_be_known(const std::string& identity) const;
  /// Whether callers that gRPC does not know must show a token.
  bool needs_token() const { return tokens_required_; }

 private:
  struct Token {
    std::string hash;
    Caller caller;
    std::time_t expiry = 0;  ///< 0: never
  };
  using Tokens = std::vector<Token>;
  struct Store {
    Mutex mutex;
    std::shared_ptr<const Tokens> tokens TS_GUARDED_BY(mutex);
  };
  static Tokens read(const std::string& path);
  static Token read_token(const std::string& line, int number);
  Caller caller_of(const std::string& authorization) const;
  static const Caller& require(const Caller& caller, Role required);
  std::optional<Token> find(const std::string& text) const;
  std::shared_ptr<const Tokens> tokens() const;

  bool tokens_required_ = false;
  std::map<std::string, Role> certificate_roles_;
  std::shared_ptr<Store> store_ = std::make_shared<Store>();
};

}  // namespace mbcosim::server
