/// `electric: …, discrete control, …, identification`: a model identified from samples. MBDyn input
/// manual, "Discrete control".
#pragma once

#include <string>
#include <vector>

#include "elements/genels/arx_identifier.h"
#include "elements/genels/sampled_control.h"

namespace mbcosim {

/// Identifies a model of the process at each sample; u_c is a persistent excitation, whose drives
/// are read in the first step after each sample (and at the start) and held till the next.
class AdaptiveControl : public SampledControl {
 public:
  struct Settings {
    ArxModel model;
    Forgetting forgetting;
    std::vector<DrivePtr> excitation;  ///< one for each input, or none
    std::string file;                  ///< the identified model, a row for each sample; empty: none
  };

  AdaptiveControl(Settings settings, Signals signals)
      : SampledControl(std::move(signals)),
        settings_(std::move(settings)),
        identifier_(settings_.model, settings_.forgetting) {}

  void connect(GeneralConnection& c) override;
  void start(const GeneralView& u, State& state) const override;
  void after_predict(const GeneralView& u, State& state) const override;
  /// u[i] as SampledControl; theta[k]: the k-th number of the row in the file; forgetting: λ.
  std::vector<std::string> private_data() const override;
  double private_value(const GeneralView& u, int datum) const override;
  bool sampled_table(SampledTable& table) const override;

 private:
  void take(const double* y, const double* u, double* memory) const override;
  void excite(const GeneralView& u, double* memory) const;

  Settings settings_;
  ArxIdentifier identifier_;
  int fresh_ = 0;  ///< offset in the element's memory: a sample has been taken
};

}  // namespace mbcosim
