/// Who besides its owner may use a simulation, and for what.
#pragma once

#include <string>
#include <vector>

#include "mbcosim/v1/simulations.pb.h"
#include "rpc/auth.h"
#include "threads/mutex.h"

namespace mbcosim::server {

/// What a call wants to do with a simulation. `see`: know that it is there; `own`: what grants do
/// not give.
enum class Access { see, observe, couple, control, own };

/// Thread-safe. The owner and admins have all rights.
class Grants {
 public:
  using List = google::protobuf::RepeatedPtrField<v1::Grant>;

  /// Throws BAD_ARGUMENT.
  static void check(const List& grants);
  /// Throws BAD_ARGUMENT for a token that the daemon does not have. Of requests: grants that were
  /// stored stay when their tokens go.
  static void check_known(const List& grants, const Authenticator& authenticator);
  /// Throws BAD_ARGUMENT.
  Grants(std::string owner, const List& grants);
  /// Throws BAD_ARGUMENT, and changes nothing then.
  void replace(const List& grants) TS_EXCLUDES(mutex_);
  /// `port`: of a call that couples.
  bool allow(const Caller& caller, Access access, const std::string& port = "") const
      TS_EXCLUDES(mutex_);
  List list() const TS_EXCLUDES(mutex_);

 private:
  const std::string owner_;
  mutable Mutex mutex_;
  List grants_ TS_GUARDED_BY(mutex_);
};

}  // namespace mbcosim::server
