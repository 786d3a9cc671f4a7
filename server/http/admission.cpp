#include "http/admission.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/random.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include "wire/metadata.h"
#include "wire/refusal.h"

namespace mbcosim::server::http {
namespace {

std::string random_token() {
  std::array<unsigned char, 24> bytes;
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw std::runtime_error("no random numbers for the start-up token");
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const unsigned char byte : bytes) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

std::string lower(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

bool is_number(std::string host) {
  if (host.size() > 2 && host.front() == '[') host = host.substr(1, host.size() - 2);
  in6_addr address{};
  return ::inet_pton(AF_INET, host.c_str(), &address) == 1 ||
         ::inet_pton(AF_INET6, host.c_str(), &address) == 1;
}

std::string this_host() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? lower(name.data()) : "localhost";
}

constexpr std::string_view kHttp = "http://", kHttps = "https://";

/// As browsers name it: they leave out the port that goes without saying.
std::string as_named(const std::string& origin) {
  std::string name = lower(origin);
  const std::string_view usual = name.starts_with(kHttps) ? ":443" : ":80";
  if (name.ends_with(usual)) name.resize(name.size() - usual.size());
  return name;
}

std::string host_of_origin(const std::string& origin) {
  return origin.substr(origin.find("://") + 3);
}

}  // namespace

void check_origins(const std::vector<std::string>& origins) {
  for (const std::string& origin : origins) {
    const std::string name = lower(origin);
    const bool known = name.starts_with(kHttp) || name.starts_with(kHttps);
    const std::string host = known ? host_of_origin(as_named(origin)) : "";
    if (!host.empty() && host.front() != ':' && host.find_first_of("/?#@ ") == std::string::npos)
      continue;
    throw std::runtime_error("--http-origin \"" + origin +
                             "\" is not of the form https://HOST or https://HOST:PORT");
  }
}

Admission::Admission(const Authenticator& authenticator, const std::string& address,
                     const std::vector<std::string>& origins)
    : authenticator_(authenticator) {
  const std::size_t colon = address.rfind(':');
  const std::string host = address.substr(0, colon);
  port_ = address.substr(colon + 1);
  any_number_ = host == "0.0.0.0";
  for (const std::string& name : {std::string("localhost"), std::string("127.0.0.1"),
                                  std::string("[::1]"), host, any_number_ ? this_host() : host})
    hosts_.insert(lower(name) + ":" + port_);
  for (const std::string& name : std::set<std::string>(hosts_)) {
    origins_.insert("http://" + name);
    if (port_ != "80") continue;  // which browsers leave out
    hosts_.insert(name.substr(0, name.rfind(':')));
    origins_.insert("http://" + name.substr(0, name.rfind(':')));
  }
  for (const std::string& origin : origins) {
    const std::string name = as_named(origin);
    origins_.insert(name);
    hosts_.insert(host_of_origin(name));
    hosts_.insert(host_of_origin(lower(origin)));
  }
  if (!authenticator_.needs_token()) startup_token_ = random_token();
  cookie_name_ = "mbcosim-" + port_;
}

std::string Admission::refuse_site(const Connection& connection) const {
  const std::string host = lower(connection.header("Host"));
  const std::size_t colon = host.rfind(':');
  const bool own_number = any_number_ && colon != std::string::npos &&
                          host.substr(colon + 1) == port_ && is_number(host.substr(0, colon));
  if (!hosts_.count(host) && !own_number)
    return "the request is for the host \"" + host +
           "\", which this daemon is not; name the address with --http-origin if it is";
  const std::string origin = lower(connection.header("Origin"));
  if (origin.empty() || origins_.count(origin) || (own_number && origin == "http://" + host))
    return "";
  return "the request comes from the web site \"" + origin +
         "\"; only this daemon's own page may call it";
}

std::optional<std::string> Admission::authorization_of(const std::string& token) const {
  if (!startup_token_.empty())
    return same_text(token, startup_token_) ? std::optional(std::string()) : std::nullopt;
  try {
    const std::string authorization = std::string(kBearer) + token;
    authenticator_.check_local(authorization, Role::observe);
    return authorization;
  } catch (const Refusal&) {
    return std::nullopt;
  }
}

std::optional<std::string> Admission::authorize(const Connection& connection) const {
  const std::string_view header = connection.header("Authorization");
  if (is_bearer(header)) return authorization_of(std::string(header.substr(kBearer.size())));
  return authorization_of(std::string(connection.cookie(cookie_name_)));
}

bool Admission::accepts(const std::string& token) const {
  return authorization_of(token).has_value();
}

}  // namespace mbcosim::server::http
