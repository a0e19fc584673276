// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "guide/guidance_output.hpp"

namespace striper::program {

/// Where guidance's decisions go beside the tables, by address: `can:INTERFACE`, `candump:FILE`,
/// `jsonl:FILE`, `-` for lines of JSON on the standard output. Tells them all, buses first.
class GuidanceOutputs : public GuidanceListener {
 public:
  struct Options {
    bool is_live = false;  ///< A truck drives: no output is waited for.
    /// Files that the same run reads or writes: no output may be one of them.
    std::vector<std::filesystem::path> taken;
  };

  /// @throws Error{kUsage} for an address that is none or is taken, and as what it opens does.
  GuidanceOutputs(const std::vector<std::string>& addresses, const GuidanceConfig& config,
                  const Options& options);
  ~GuidanceOutputs() override;

  /// Another that hears, last of all, also after `finish`; it must live as long.
  void add(GuidanceListener& listener) { others_.push_back(&listener); }
  /// Whether one of them is a thing of the present: a run is then played at its own pace.
  bool is_live() const noexcept { return is_live_; }

  void lateral(const LateralLine& line) override;
  void switch_gun(std::size_t gun, bool is_on, double time_s) override;
  void gun(const GunLine& line) override;
  void seen(const SeenLine& line) override;
  void fault(const FaultLine& line) override;
  void switch_laser_off(double time_s) override;

  /// Guns off and the safe voltage until guidance says otherwise: where nothing comes in any more.
  void make_safe(const LateralLine& safe);

  /// Makes safe and closes all, buses first; what comes later goes to the tables alone. Says what
  /// was not taken. @return whether all was. @throws what the first of them throws, after all.
  bool finish();

 private:
  template <typename Tell>
  void tell_all(const Tell& tell);

  struct Output {
    std::string address;
    std::unique_ptr<GuidanceOutput> to;
  };
  std::vector<Output> outputs_;
  std::vector<GuidanceListener*> others_;
  std::size_t guns_;  // Which of them are on each output knows by itself, from what it has said.
  bool is_live_ = false;
  bool is_finished_ = false;
  bool is_whole_ = true;
};

/// What `--to` can be, for its help.
extern const char* const kGuidanceOutputsHelp;

}  // namespace striper::program
