// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <fstream>
#include <ios>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "stripe/report/patches/rated_patches.hpp"
#include "stripe/select/evidence/evidence.hpp"
#include "support/extracted_trial.hpp"
#include "support/stripe_score.hpp"

namespace striper {

/// What the image shows about doubted returns, as fit_patches.py reads it: OUT.patches, OUT.returns
/// and OUT.evidence.
class PatchFiles {
 public:
  explicit PatchFiles(const std::string& path)
      : patches_(path + ".patches", std::ios::binary),
        returns_(path + ".returns", std::ios::binary),
        evidence_(path + ".evidence", std::ios::binary) {
    for (std::ofstream* file : {&patches_, &returns_, &evidence_}) {
      file->exceptions(std::ios::failbit | std::ios::badbit);
    }
  }

  /// The doubted returns of a frame and a patch for every few of them.
  void add(const testing::Extracted& extracted) {
    const auto& [extractor, frame, stripe, truth] = extracted;
    const std::vector<float>& odds = extractor.confidence().among_others();
    detail::RatedPatches patches({frame, stripe, odds});
    for (std::size_t line = 0; line < odds.size(); ++line) {
      const bool is_of_it = !extractor.is_bridged(static_cast<int>(line));
      if (!is_of_it || !detail::RatedPatches::is_doubted(odds[line])) continue;
      if (patches.look_at(line)) add_patch(patches.patch());
      add_return(extracted, line, patches.place());
    }
  }

 private:
  struct Return {
    std::uint32_t patch;
    std::uint8_t is_right, is_known, unused[2];
    float odds;
    detail::PatchNet::Place place;
  };
  static_assert(sizeof(Return) == 24);

  void add_patch(const detail::ReturnPatch& patch) {
    cv::Mat halves;
    cv::convertFp16(
        cv::Mat(1, static_cast<int>(patch.of.size()), CV_32F, const_cast<float*>(patch.of.data())),
        halves);
    patches_.write(halves.ptr<char>(), static_cast<std::streamsize>(2 * patch.of.size()));
    ++count_;
  }

  void add_return(const testing::Extracted& extracted, std::size_t line,
                  const detail::PatchNet::Place& at) {
    const auto& [extractor, frame, stripe, truth] = extracted;
    const int number = static_cast<int>(line);
    const testing::Judgement judged =
        testing::judge_position(truth, number, stripe.across_px[line],
                                static_cast<double>(stripe.sigma_px[line]))
            .judgement;
    const Return row{count_ - 1,
                     static_cast<std::uint8_t>(judged == testing::Judgement::kRight),
                     static_cast<std::uint8_t>(judged != testing::Judgement::kMixed),
                     {},
                     extractor.confidence().among_others()[line],
                     at};
    const detail::Evidence evidence = extractor.evidence(stripe, number);
    returns_.write(reinterpret_cast<const char*>(&row), sizeof row);
    evidence_.write(reinterpret_cast<const char*>(&evidence), sizeof evidence);
  }

  std::ofstream patches_, returns_, evidence_;
  std::uint32_t count_ = 0;
};

}  // namespace striper
