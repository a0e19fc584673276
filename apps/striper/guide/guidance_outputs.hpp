// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <striper/guidance/guidance.hpp>

namespace striper::program {

/// Where guidance's decisions go beside the tables, by address: `can:INTERFACE`, `candump:FILE`,
/// `jsonl:FILE`, `-` for lines of JSON on the standard output. Tells them all.
class GuidanceOutputs : public GuidanceListener {
 public:
  /// @throws Error{kUsage} for an address that is none, and as what it opens does.
  GuidanceOutputs(const std::vector<std::string>& addresses, const GuidanceConfig& config);
  ~GuidanceOutputs() override;

  /// Another that hears, last of all; it must live as long.
  void add(GuidanceListener& listener) { listeners_.push_back(&listener); }
  /// Whether one of them is a thing of the present: a run is then played at its own pace.
  bool is_live() const noexcept { return is_live_; }

  void lateral(const LateralLine& line) override;
  void switch_gun(std::size_t gun, bool is_on, double time_s) override;
  void gun(const GunLine& line) override;
  void seen(const SeenLine& line) override;
  void fault(const FaultLine& line) override;
  void switch_laser_off(double time_s) override;

  /// Makes safe and closes all; says what a bus did not take. @return whether it took all.
  bool finish();

 private:
  struct Output;
  std::vector<std::unique_ptr<Output>> outputs_;
  std::vector<GuidanceListener*> listeners_;
  bool is_live_ = false;
};

/// What `--to` can be, for its help.
extern const char* const kGuidanceOutputsHelp;

}  // namespace striper::program
