/// Who besides its owner may use a simulation, and for what.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "mbcosim/v1/simulations.pb.h"
#include "rpc/auth.h"
#include "threads/mutex.h"

namespace mbcosim::server {

/// What a call wants to do with a simulation. `see`: know that it is there; `own`: what grants do
/// not give.
enum class Access { see, observe, couple, control, own };

/// Who may do what at one moment; it never changes. The owner and admins have all rights.
class Rights {
 public:
  using List = google::protobuf::RepeatedPtrField<v1::Grant>;
  Rights(std::string owner, List grants);

  const std::string& owner() const { return owner_; }
  const List& list() const { return grants_; }
  std::size_t bytes() const { return bytes_; }
  /// `port`: of a call that couples.
  bool allow(const Caller& caller, Access access, const std::string& port = "") const;
  /// Throws NO_SUCH_SIMULATION when the caller may not even see the one of this name, NOT_GRANTED.
  void require(const std::string& id, const Caller& caller, Access access,
               const std::string& port = "") const;

 private:
  const std::string owner_;
  const List grants_;
  const std::size_t bytes_;
};
using RightsPtr = std::shared_ptr<const Rights>;

/// Rights that change. Thread-safe.
class Grants {
 public:
  using List = Rights::List;

  /// Throws BAD_ARGUMENT.
  static void check(const List& grants);
  /// Throws BAD_ARGUMENT for a token that the daemon does not have. Of requests: grants that were
  /// stored stay when their tokens go.
  static void check_known(const List& grants, const Authenticator& authenticator);
  /// Throws BAD_ARGUMENT.
  Grants(std::string owner, const List& grants);
  /// Throws BAD_ARGUMENT, and changes nothing then.
  void replace(const List& grants) TS_EXCLUDES(mutex_);
  const std::string& owner() const { return owner_; }
  RightsPtr now() const TS_EXCLUDES(mutex_);
  bool allow(const Caller& caller, Access access, const std::string& port = "") const {
    return caller.may_touch(owner_) || now()->allow(caller, access, port);
  }
  void require(const std::string& id, const Caller& caller, Access access,
               const std::string& port = "") const {
    if (!caller.may_touch(owner_)) now()->require(id, caller, access, port);
  }
  List list() const { return now()->list(); }

 private:
  const std::string owner_;
  mutable Mutex mutex_;
  RightsPtr rights_ TS_GUARDED_BY(mutex_);
};

/// Throws NO_SUCH_SIMULATION.
[[noreturn]] void refuse_unknown(const std::string& id);

}  // namespace mbcosim::server
