#include "rpc/health.h"

#include <arpa/inet.h>

#include <optional>

#include "grpc/health/v1/health.pb.h"
#include "host/addresses.h"
#include "rpc/methods.h"

namespace mbcosim::server {
namespace {

using grpc::health::v1::HealthCheckRequest;
using grpc::health::v1::HealthCheckResponse;

/// "ipv4:127.0.0.1" of "ipv4:127.0.0.1:40000", the network of addresses of version 6, "unix" of
/// sockets in files.
std::string host_of(const std::string& peer) {
  constexpr std::string_view kOpen = "%5B";
  const std::string host = peer.substr(0, peer.rfind(':'));
  const std::size_t open = host.find(kOpen), first = open + kOpen.size();
  if (open == std::string::npos) return host;
  in6_addr address{};
  const std::string number = host.substr(first, host.find('%', first) - first);
  if (::inet_pton(AF_INET6, number.c_str(), &address) != 1) return host;
  keep_network(address);
  return {reinterpret_cast<const char*>(&address), sizeof address};
}

}  // namespace

grpc::ByteBuffer Health::answer(const std::string& service) const {
  HealthCheckResponse response;
  response.set_status(!knows(service) ? HealthCheckResponse::SERVICE_UNKNOWN
                      : serving_      ? HealthCheckResponse::SERVING
                                      : HealthCheckResponse::NOT_SERVING);
  return serialized(response);
}

class Health::Check final : public Handler {
 public:
  explicit Check(Health& health) : health_(health) {}

 private:
  void on_message(Exchange& exchange, grpc::ByteBuffer message) override {
    HealthCheckRequest request;
    parse(exchange.memory(), message, &request, nullptr);
    if (!health_.knows(request.service()))
      return exchange.finish({grpc::StatusCode::NOT_FOUND, "no such service"});
    Guard guard(health_.mutex_);
    exchange.end(health_.answer(request.service()));
  }
  void on_half_close(Exchange& exchange) override {
    exchange.finish({grpc::StatusCode::INVALID_ARGUMENT, "the call came without its message"});
  }

  Health& health_;
};

class Health::Watch final : public Handler {
 public:
  explicit Watch(Health& health) : health_(health) {}
  const std::string& service() const { return service_; }
  void tell(grpc::ByteBuffer answer) { exchange_->write(std::move(answer)); }

 private:
  void on_message(Exchange& exchange, grpc::ByteBuffer message) override {
    HealthCheckRequest request;
    parse(exchange.memory(), message, &request, nullptr);
    if (!place_.emplace(health_.places_, host_of(exchange.peer())).held())
      throw limit_refusal("health_watchers", kWatchersOfHost,
                          "the server's health is watched by many");
    Guard guard(health_.mutex_);
    exchange_ = &exchange;
    service_ = request.service();
    health_.watchers_.insert(this);
    tell(health_.answer(service_));
  }
  void on_half_close(Exchange& exchange) override {
    exchange.finish({grpc::StatusCode::INVALID_ARGUMENT, "the call came without its message"});
  }
  void on_done(Exchange&, bool) override {
    Guard guard(health_.mutex_);
    health_.watchers_.erase(this);
  }

  Health& health_;
  Exchange* exchange_ = nullptr;
  std::string service_;
  std::optional<Place> place_;
};

void Health::add_to(Gate& gate, bool open) {
  const std::string path = "/grpc.health.v1.Health/";
  gate.add(path + "Check",
           {Role::observe, open, Counted::no, [this] { return std::make_unique<Check>(*this); }});
  gate.add(path + "Watch",
           {Role::observe, open, Counted::no, [this] { return std::make_unique<Watch>(*this); }});
}

void Health::stop() {
  Guard guard(mutex_);
  if (!std::exchange(serving_, false)) return;
  for (Watch* watcher : watchers_) watcher->tell(answer(watcher->service()));
}

}  // namespace mbcosim::server
