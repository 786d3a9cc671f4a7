/// Who may come in through the HTTP door.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "http/connection.h"
#include "rpc/auth.h"

namespace mbcosim::server::http {

/// Throws std::runtime_error unless each is "https://HOST" or "https://HOST:PORT" (or http).
void check_origins(const std::vector<std::string>& origins);

/// Checks `Host` and `Origin`, so that a foreign web site can neither post to this host nor pose
/// as it, and the caller's token: one of the daemon's tokens, or the start-up token where there are
/// none.
class Admission {
 public:
  /// `address` is "HOST:PORT" as bound; `origins` are further ones: "https://sim.example.org".
  Admission(const Authenticator& authenticator, const std::string& address,
            const std::vector<std::string>& origins);

  /// Why the request does not come in at all; empty: it does.
  std::string refuse_site(const Connection& connection) const;
  /// What gRPC's metadata get as `authorization`; may be empty. No value: no token, or a wrong one.
  std::optional<std::string> authorize(const Connection& connection) const;
  /// The same for a token that stands in an address.
  bool accepts(const std::string& token) const;

  /// The start-up token; empty where the daemon has tokens of its own.
  const std::string& startup_token() const { return startup_token_; }
  /// Of the cookie that keeps the token; cookies do not tell ports apart, so its name does.
  const std::string& cookie_name() const { return cookie_name_; }

 private:
  std::optional<std::string> authorization_of(const std::string& token) const;

  const Authenticator& authenticator_;
  bool any_number_ = false;  ///< bound to all addresses: any numeric host is ours
  std::string port_;
  std::set<std::string> hosts_;    ///< "localhost:8765"
  std::set<std::string> origins_;  ///< "http://localhost:8765"
  std::string startup_token_, cookie_name_;
};

}  // namespace mbcosim::server::http
