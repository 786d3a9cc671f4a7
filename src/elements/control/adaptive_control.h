/// `electric: …, discrete control`, `identification` and `adaptive control`: a model identified
/// from samples, and a controller that follows from it. MBDyn input manual, "Discrete control".
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "elements/control/arx_identifier.h"
#include "elements/control/predictive_law.h"
#include "elements/control/sampled_control.h"

namespace mbcosim {

/// Identifies a model of the process at each sample. u_c is a persistent excitation and, as long as
/// the trigger is not zero, what a predictive law makes of the model. Their drives are read in the
/// first step after each sample (the excitation at the start, too), u_c is held till the next.
class AdaptiveControl : public SampledControl {
 public:
  struct Settings {
    ArxModel model;
    Forgetting forgetting;
    std::vector<DrivePtr> excitation;            ///< one for each input, or none
    std::optional<PredictiveLaw::Settings> law;  ///< none: identification alone
    DrivePtr control_weight;                     ///< w of the law; null: 0
    DrivePtr trigger;                            ///< null: always
    std::vector<DrivePtr> desired;               ///< one for each output, or none: zero
    std::string file;  ///< the identified model, a row for each sample; empty: none
  };

  AdaptiveControl(Settings settings, Signals signals)
      : SampledControl(std::move(signals)),
        settings_(std::move(settings)),
        identifier_(settings_.model, settings_.forgetting) {
    if (settings_.law) law_.emplace(*settings_.law);
  }

  void connect(GeneralConnection& c) override;
  void start(const GeneralView& u, State& state) const override;
  void after_predict(const GeneralView& u, State& state) const override;
  /// u[i] as SampledControl; theta[k]: the k-th number of the row in the file; forgetting: λ.
  int private_datum(std::string_view name) const override;
  std::vector<Datum> private_data() const override;
  double private_value(const GeneralView& u, int datum) const override;
  bool sampled_table(SampledTable& table) const override;

 private:
  void add_sample(const double* y, const double* u, double* memory) const override;
  void excite(const GeneralView& u, double* memory) const;
  void obey_law(const GeneralView& u, double* memory) const;

  Settings settings_;
  ArxIdentifier identifier_;
  std::optional<PredictiveLaw> law_;
  /// Offsets in the element's memory: a sample has been taken; desired outputs.
  int fresh_ = 0, desired_ = 0;
};

}  // namespace mbcosim
