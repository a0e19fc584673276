// SPDX-License-Identifier: Apache-2.0
// Proves that image files of a directory, whole and as interlaced fields, keep the promises of a
// source.
#include <filesystem>
#include <string>

#include <opencv2/imgcodecs.hpp>
#include <unistd.h>

#include <striper/capture/open_source.hpp>
#include <striper/images/image_source.hpp>

#include "capture/conformance/frame_source_conformance.hpp"

namespace striper::testing {
namespace {

// Thirty different images, written once; the directory goes with the program.
class ImageFiles {
 public:
  ImageFiles()
      : folder_(std::filesystem::temp_directory_path() /
                ("striper_conformance_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(folder_);
    for (int number = 0; number < 30; ++number) {
      cv::Mat image(48, 64, CV_8UC1);
      for (int row = 0; row < image.rows; ++row) image.row(row).setTo((7 * number + 3 * row) % 256);
      cv::imwrite(folder_ / ("image" + std::to_string(number) + ".png"), image);
    }
  }
  ImageFiles(const ImageFiles&) = delete;
  ImageFiles& operator=(const ImageFiles&) = delete;
  ~ImageFiles() { std::filesystem::remove_all(folder_); }

  std::string path() const { return folder_.string(); }
  std::string uri(const std::string& query) const { return "images:" + path() + query; }

 private:
  std::filesystem::path folder_;
};

const ImageFiles& written_files() {
  static const ImageFiles kFiles;
  return kFiles;
}

SourceUnderTest directory(const std::string& name, const std::string& query) {
  return {name, [query] { return open_source(written_files().uri(query)); }, true};
}

SourceUnderTest from_options() {
  const auto open = [] {
    ImageOptions options;
    options.path = written_files().path();
    options.fps = 25.0;
    options.pattern = IlluminationPattern::parse("0,dark");
    options.fields = Field::kInterlacedTopFirst;
    return std::make_unique<ImageSource>(options);
  };
  return {"options", open, true};
}

INSTANTIATE_TEST_SUITE_P(Images, FrameSourceConformance,
                         ::testing::Values(directory("progressive", "?fps=25"),
                                           directory("interlaced", "?fps=25&fields=split-bottom"),
                                           directory("pattern", "?fps=50&laser=0,dark"),
                                           from_options()),
                         source_name);

}  // namespace
}  // namespace striper::testing
