// SPDX-License-Identifier: Apache-2.0
// Proves that findings are as bad as the worst of them, in any order, and what severities are
// called. Which findings there are is proved with what makes them.
#include <vector>

#include <gtest/gtest.h>

#include <striper/joint/finding.hpp>

namespace striper {
namespace {

using Severity = Finding::Severity;

std::vector<Finding> findings_of(const std::vector<Severity>& severities) {
  std::vector<Finding> findings;
  findings.reserve(severities.size());
  for (const Severity severity : severities) findings.push_back({severity, "code", "", ""});
  return findings;
}

TEST(Findings, AreAsBadAsTheWorstWhereverItIs) {
  EXPECT_EQ(worst({}), Severity::kNote);
  for (const Severity bad : {Severity::kNote, Severity::kWarning, Severity::kRefusal}) {
    for (std::size_t at = 0; at < 4; ++at) {
      std::vector<Severity> severities(4, Severity::kNote);
      severities[at] = bad;
      EXPECT_EQ(worst(findings_of(severities)), bad) << at;
    }
  }
  EXPECT_EQ(worst(findings_of({Severity::kRefusal, Severity::kWarning})), Severity::kRefusal);
}

TEST(Findings, SeveritiesAreCalledAsInTheSummary) {
  EXPECT_EQ(to_string(Severity::kNote), "note");
  EXPECT_EQ(to_string(Severity::kWarning), "warning");
  EXPECT_EQ(to_string(Severity::kRefusal), "refusal");
}

}  // namespace
}  // namespace striper
