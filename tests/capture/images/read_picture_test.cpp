// SPDX-License-Identifier: Apache-2.0
// Proves that every format is read to the bit that OpenCV's encoders wrote (JPEG: to the bit that
// OpenCV decodes), and that a file cut at any of many lengths is never taken for a whole image.
// Does not prove that damage within compressed data is found where the format has no check sum.
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sys/stat.h>

#include <striper/core/error.hpp>
#include <striper/images/read_picture.hpp>

#include "support/error_of.hpp"
#include "support/random.hpp"
#include "support/scratch_directory.hpp"
#include "support/shared_data.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;
using testing::ScratchDirectory;

bool is_equal(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0.0;
}

// A bright stripe on noise, so that compressed images have something to lose on every row.
cv::Mat draw_image(int type, cv::Size size = {61, 47}) {
  const double full_scale = CV_MAT_DEPTH(type) == CV_16U ? 65535.0 : 255.0;
  cv::Mat image(size, type);
  cv::Mat plain = image.reshape(1);
  for (int v = 0; v < plain.rows; ++v) {
    for (int i = 0; i < plain.cols; ++i) {
      const double value = testing::uniform(0.0, 0.2) + (v == plain.rows / 2 ? 0.7 : 0.0);
      if (plain.depth() == CV_16U) {
        plain.at<std::uint16_t>(v, i) = static_cast<std::uint16_t>(value * full_scale);
      } else {
        plain.at<std::uint8_t>(v, i) = static_cast<std::uint8_t>(value * full_scale);
      }
    }
  }
  return image;
}

Error error_of(const std::filesystem::path& path) {
  return testing::error_of([&] { read_image(path); });
}

struct Encoding {
  std::string name;
  std::string extension;
  int type;
  std::vector<int> parameters;

  friend void PrintTo(const Encoding& encoding, std::ostream* stream) { *stream << encoding.name; }
};

class EveryFormat : public ::testing::TestWithParam<Encoding> {
 protected:
  std::filesystem::path write(const cv::Mat& image) {
    auto path = scratch_ / ("image" + GetParam().extension);
    EXPECT_TRUE(cv::imwrite(path.string(), image, GetParam().parameters));
    return path;
  }
  bool is_lossless() const { return GetParam().extension != ".jpg"; }

  ScratchDirectory scratch_;
};

TEST_P(EveryFormat, ReadsBackWhatWasWritten) {
  const cv::Mat image = draw_image(GetParam().type);
  const auto path = write(image);
  const DecodedImage decoded = read_image(path);
  const cv::Mat expected = is_lossless() ? image : cv::imread(path, cv::IMREAD_UNCHANGED);
  EXPECT_TRUE(is_equal(decoded.image, expected));
  EXPECT_EQ(decoded.bit_depth, image.depth() == CV_16U ? 16 : 8);
}

TEST_P(EveryFormat, IsRefusedWhenCutAtAnyLength) {
  const cv::Mat image = draw_image(GetParam().type);
  const std::string whole = testing::read_bytes(write(image));
  const cv::Mat pixels = read_image(scratch_ / ("image" + GetParam().extension)).image;
  const auto cut = scratch_ / ("cut" + GetParam().extension);

  std::set<std::size_t> lengths{0, 1, 2, 3, 4, 8};
  for (std::size_t back = 1; back <= 40; ++back) lengths.insert(whole.size() - back);
  for (int i = 1; i < 60; ++i) lengths.insert(whole.size() * static_cast<std::size_t>(i) / 60);

  std::size_t complete_all_the_same = 0;
  for (const std::size_t length : lengths) {
    testing::write_bytes(cut, whole.substr(0, length));
    try {
      // Only where what is missing is not pixels (a trailing tag) may it still be read.
      EXPECT_TRUE(is_equal(read_image(cut).image, pixels)) << length << " of " << whole.size();
      ++complete_all_the_same;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kBadFile);
      EXPECT_THAT(error.what(), HasSubstr("'" + cut.string() + "' is "));
    }
  }
  // TIFF: the pointer to a second image; plain text: the last blank and line end.
  EXPECT_LE(complete_all_the_same, 4U);
}

const std::vector<Encoding> kEncodings{
    {"PngGrey8", ".png", CV_8UC1, {}},
    {"PngGrey16", ".png", CV_16UC1, {}},
    {"PngColour8", ".png", CV_8UC3, {}},
    {"PngColour16", ".png", CV_16UC3, {}},
    {"JpegGrey", ".jpg", CV_8UC1, {}},
    {"JpegColour", ".jpg", CV_8UC3, {}},
    {"JpegProgressive", ".jpg", CV_8UC3, {cv::IMWRITE_JPEG_PROGRESSIVE, 1}},
    {"JpegRestarts", ".jpg", CV_8UC1, {cv::IMWRITE_JPEG_RST_INTERVAL, 2}},
    {"TiffGrey8", ".tif", CV_8UC1, {}},
    {"TiffGrey16", ".tif", CV_16UC1, {}},
    {"TiffColour8", ".tiff", CV_8UC3, {}},
    {"TiffColour16", ".tif", CV_16UC3, {}},
    {"TiffPlain8", ".tif", CV_8UC1, {cv::IMWRITE_TIFF_COMPRESSION, 1}},
    {"TiffPlain16", ".tif", CV_16UC1, {cv::IMWRITE_TIFF_COMPRESSION, 1}},
    {"TiffDeflate", ".tif", CV_16UC1, {cv::IMWRITE_TIFF_COMPRESSION, 8}},
    {"BmpGrey", ".bmp", CV_8UC1, {}},
    {"BmpColour", ".bmp", CV_8UC3, {}},
    {"Pgm8", ".pgm", CV_8UC1, {}},
    {"Pgm16", ".pgm", CV_16UC1, {}},
    {"PgmText", ".pgm", CV_8UC1, {cv::IMWRITE_PXM_BINARY, 0}},
    {"Ppm8", ".ppm", CV_8UC3, {}},
    {"Ppm16", ".ppm", CV_16UC3, {}},
    {"PpmText", ".ppm", CV_8UC3, {cv::IMWRITE_PXM_BINARY, 0}},
};

INSTANTIATE_TEST_SUITE_P(ReadImage, EveryFormat, ::testing::ValuesIn(kEncodings),
                         [](const auto& encoding) { return encoding.param.name; });

TEST(ReadImage, PgmMaximumSaysHowManyBitsAreSignificant) {
  const ScratchDirectory scratch;
  const std::string pixels("\x0f\xff\x00\x01", 4);  // Big-endian 4095, 1.
  testing::write_bytes(scratch / "a.pgm", "P5 # a comment\n2 1\n4095\n" + pixels);
  const DecodedImage decoded = read_image(scratch / "a.pgm");
  EXPECT_EQ(decoded.bit_depth, 12);
  EXPECT_EQ(decoded.image.at<std::uint16_t>(0, 0), 4095);
  EXPECT_EQ(decoded.image.at<std::uint16_t>(0, 1), 1);
}

TEST(ReadImage, AlphaIsDropped) {
  const ScratchDirectory scratch;
  cv::Mat image(3, 4, CV_8UC4, cv::Scalar(10, 20, 30, 128));
  cv::imwrite((scratch / "a.png").string(), image);
  const DecodedImage decoded = read_image(scratch / "a.png");
  ASSERT_EQ(decoded.image.type(), CV_8UC3);
  EXPECT_EQ(decoded.image.at<cv::Vec3b>(2, 3), cv::Vec3b(10, 20, 30));
}

TEST(ReadImage, FormatIsToldByContentNotByName) {
  const ScratchDirectory scratch;
  const cv::Mat image = draw_image(CV_8UC1);
  cv::imwrite((scratch / "a.png").string(), image);
  std::filesystem::rename(scratch / "a.png", scratch / "a.jpg");
  EXPECT_TRUE(is_equal(read_image(scratch / "a.jpg").image, image));
}

TEST(ReadImage, DamagedBytesInPngAreFoundByItsCheckSum) {
  const ScratchDirectory scratch;
  cv::imwrite((scratch / "a.png").string(), draw_image(CV_8UC1));
  std::string bytes = testing::read_bytes(scratch / "a.png");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 0x10);
  testing::write_bytes(scratch / "a.png", bytes);
  EXPECT_THAT(error_of(scratch / "a.png").what(), HasSubstr("damaged"));
}

// Flips bits all over the file: whatever is made of it, it is an Error or an image, never a crash.
TEST_P(EveryFormat, SurvivesFlippedBits) {
  const cv::Mat image = draw_image(GetParam().type, {23, 17});
  const std::string whole = testing::read_bytes(write(image));
  const auto path = scratch_ / "flipped";
  for (int trial = 0; trial < 150; ++trial) {
    std::string bytes = whole;
    for (int flip = 0; flip < 3; ++flip) {
      // Half of them in the first 64 bytes, where the sizes are.
      const double end = trial % 2 == 0 ? 64.0 : static_cast<double>(bytes.size());
      const auto at = static_cast<std::size_t>(testing::uniform(0.0, end));
      const auto bit = static_cast<unsigned>(testing::uniform(0.0, 8.0));
      bytes.at(at % bytes.size()) ^= static_cast<char>(1U << bit);
    }
    testing::write_bytes(path, bytes);
    try {
      EXPECT_FALSE(read_image(path).image.empty());
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kBadFile);
    }
  }
}

TEST(ReadImage, MadeUpSizesAreRefusedBeforeMemoryIsTaken) {
  const ScratchDirectory scratch;
  testing::write_bytes(scratch / "a.pgm", "P5 60000 60000 255\n");
  EXPECT_THAT(error_of(scratch / "a.pgm").what(), HasSubstr("claims a size of 60000x60000"));
  testing::write_bytes(scratch / "b.pgm", "P5 0 5 255\n");
  EXPECT_THAT(error_of(scratch / "b.pgm").what(), HasSubstr("claims a size of 0x5"));
}

TEST(ReadImage, ErrorsNameTheFileAndTheirKind) {
  const ScratchDirectory scratch;
  EXPECT_EQ(error_of(scratch / "none.png").kind(), ErrorKind::kNotFound);
  EXPECT_THAT(error_of(scratch / "none.png").what(), HasSubstr("none.png': No such file"));
  EXPECT_EQ(error_of(scratch.path()).kind(), ErrorKind::kIo);
  EXPECT_THAT(error_of(scratch.path()).what(), HasSubstr("Is a directory"));

  testing::write_bytes(scratch / "empty.png", "");
  EXPECT_THAT(error_of(scratch / "empty.png").what(), HasSubstr("is empty (0 bytes)"));
  testing::write_bytes(scratch / "text.png", "hello");
  EXPECT_THAT(error_of(scratch / "text.png").what(), HasSubstr("is no PNG, JPEG, TIFF"));

  ASSERT_EQ(::mkfifo((scratch / "pipe.png").c_str(), 0600), 0);
  EXPECT_EQ(error_of(scratch / "pipe.png").kind(), ErrorKind::kIo);
}

TEST(ReadImage, RealJpegsAreWhole) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("neil-rover-striper");
  const auto path = testing::real_data("neil-rover-striper") / "img0002.jpg";
  EXPECT_TRUE(is_equal(read_image(path).image, cv::imread(path, cv::IMREAD_UNCHANGED)));
}

}  // namespace
}  // namespace striper
