// SPDX-License-Identifier: Apache-2.0
// Proves that the report of a calibration is one file that needs nothing else, says the verdict
// first and every finding with its advice, shows every image, and survives names that are HTML
// and images that are gone. How it looks, a person must judge.
#include <gmock/gmock.h>

#include <striper/core/error.hpp>
#include <striper/report/report.hpp>

#include "adjust/monte_carlo_support.hpp"
#include "support/error_of.hpp"
#include "support/scratch_directory.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using testing::SyntheticStriper;

// A calibration from simulated points, its images plain grey.
Calibration simulated() {
  SyntheticStriper striper;
  striper.stripe_step = 8;
  Calibration c;
  c.observations = testing::varied_boards(striper, 9);
  c.solution = solve_joint(c.observations, c.options);
  c.model = testing::model_of(c.solution);
  c.validation = cross_validate(c.observations, c.solution, c.options, 1);
  c.depths_m = {{0.8, 2.4}};
  c.range_sigmas = {predict_range_sigma(c.model, 0, {1.0, 2.0, 4.0}, 0.8, 2.4)};
  for (std::size_t v = 0; v < c.observations.views.size(); ++v) {
    ImageResult result;
    result.image =
        SessionImage(c.observations.views[v].name, cv::Mat(480, 640, CV_8UC1, cv::Scalar(90)));
    result.lit = result.image;
    result.laser = 0;
    result.view = static_cast<int>(v);
    result.stripe_view = static_cast<int>(v);
    result.board.found = true;
    result.board.corners_px = c.observations.views[v].pixel;
    result.board.reliable.assign(result.board.corners_px.size(), 1);
    c.images.push_back(std::move(result));
  }
  return c;
}

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

TEST(FormatReport, SaysTheVerdictBeforeAnyFigure) {
  Calibration c = simulated();
  c.findings.push_back(
      {Severity::kRefusal, "boards_parallel", "the boards are parallel", "tilt the board"});
  const std::string html = format_report(c);
  EXPECT_LT(html.find("Do not trust this calibration: the boards are parallel."),
            html.find("<table"));
  EXPECT_THAT(html, HasSubstr("tilt the board"));
  EXPECT_THAT(html, HasSubstr("class=\"verdict bad\""));
  c.findings.front().severity = Severity::kWarning;
  EXPECT_THAT(format_report(c), HasSubstr("class=\"verdict warn\""));
  c.findings.clear();
  EXPECT_THAT(format_report(c), HasSubstr("This calibration can be trusted."));
}

TEST(FormatReport, NeedsNothingElse) {
  const std::string html = format_report(simulated());
  EXPECT_THAT(html, HasSubstr("<!doctype html>"));
  EXPECT_THAT(html, HasSubstr("</html>"));
  for (const char* outside : {"http://", "https://", "<script", "<link", "url("})
    EXPECT_THAT(html, Not(HasSubstr(outside)));
  EXPECT_EQ(9U, count_of(html, "class=\"card\""));
  EXPECT_EQ(count_of(html, "<svg"), count_of(html, "</svg>"));
  EXPECT_EQ(count_of(html, "<div"), count_of(html, "</div>"));
  EXPECT_EQ(count_of(html, "<table"), count_of(html, "</table>"));
  EXPECT_THAT(html, Not(HasSubstr("nan")));
}

TEST(FormatReport, SaysWhichLensTheImagesDoNotDetermine) {
  Calibration c = simulated();
  c.lens.trials = {{LensModel::kPlumbBob, false, 0.1, 0.12}, {LensModel::kRationalPolynomial}};
  const std::string html = format_report(c);
  EXPECT_THAT(html, HasSubstr("plumb_bob (chosen)</td><td class=\"n\">0.100 px"));
  EXPECT_THAT(html, HasSubstr("rational_polynomial (not determined by these images)"));
  EXPECT_THAT(html, Not(HasSubstr("nan")));
}

TEST(FormatReport, EscapesNamesAndShowsWhatIsGone) {
  Calibration c = simulated();
  c.images[0].image = SessionImage(std::filesystem::path("/gone/<b>&.png"));
  c.images[0].lit = c.images[0].image;
  const std::string html = format_report(c);
  EXPECT_THAT(html, HasSubstr("&lt;b&gt;&amp;.png"));
  EXPECT_THAT(html, Not(HasSubstr("<b>&.png")));
}

TEST(FormatReport, IsWrittenForACameraAlone) {
  Calibration c = simulated();
  c.observations.stripes.clear();
  c.solution = solve_joint(c.observations, c.options);
  c.model.lasers.clear();
  c.model.covariance.reset();
  c.validation = CrossValidation();
  c.range_sigmas.clear();
  c.depths_m.clear();
  for (ImageResult& result : c.images) result.laser = result.stripe_view = -1;
  const std::string html = format_report(c);
  EXPECT_THAT(html, Not(HasSubstr("Laser 0")));
  EXPECT_EQ(9U, count_of(html, "class=\"card\""));
}

TEST(SaveReport, NamesTheFileThatCannotBeWritten) {
  const testing::ScratchDirectory directory;
  const Calibration c = simulated();
  save_report(c, directory / "report.html");
  EXPECT_EQ(format_report(c), testing::read_bytes(directory / "report.html"));
  const Error error =
      testing::error_of([&] { save_report(c, directory / "absent" / "report.html"); });
  EXPECT_EQ(ErrorKind::kIo, error.kind());
  EXPECT_THAT(error.what(), HasSubstr("report.html"));
}

}  // namespace
}  // namespace striper
