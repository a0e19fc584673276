// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <span>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <unistd.h>

#include <striper/core/error.hpp>
#include <striper/images/picture_files.hpp>
#include <striper/images/recorder.hpp>

#include "images/frame_table.hpp"

namespace striper {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, int failure) {
  throw Error(ErrorKind::kIo, fmt::format("cannot write '{}': {}", path.string(),
                                          std::generic_category().message(failure)));
}

int write_all(int file, std::span<const unsigned char> bytes) {
  while (!bytes.empty()) {
    const ssize_t done = ::write(file, bytes.data(), bytes.size());
    if (done < 0 && errno == EINTR) continue;
    if (done < 0) return errno;
    bytes = bytes.subspan(static_cast<std::size_t>(done));
  }
  return 0;
}

// The file appears under its name with all of its bytes, or not at all.
void write_whole_file(const fs::path& path, std::span<const unsigned char> bytes) {
  const fs::path partial = path.string() + ".part";
  const int file = ::open(partial.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file < 0) fail(path, errno);
  int failure = write_all(file, bytes);
  if (::close(file) != 0 && failure == 0) failure = errno;
  if (failure == 0 && ::rename(partial.c_str(), path.c_str()) != 0) failure = errno;
  if (failure != 0) {
    ::unlink(partial.c_str());
    fail(path, failure);
  }
}

bool holds_images(const fs::path& directory) {
  try {
    return !image_files(directory.string()).empty();
  } catch (const Error& error) {
    if (error.kind() == ErrorKind::kNotFound) return false;
    throw;
  }
}

void make_empty_directory(const fs::path& directory) {
  std::error_code failure;
  fs::create_directories(directory, failure);
  if (failure) fail(directory, failure.value());
  const bool has_table = fs::exists(directory / detail::kFrameTableName, failure);
  if (failure) fail(directory, failure.value());
  if (has_table || holds_images(directory)) {
    throw Error(
        ErrorKind::kUsage,
        fmt::format("'{}' already holds a recording or image files: name another directory, or "
                    "remove it first",
                    directory.string()));
  }
}

bool is_recordable(const cv::Mat& image) {
  return !image.empty() && (image.depth() == CV_8U || image.depth() == CV_16U) &&
         (image.channels() == 1 || image.channels() == 3);
}

}  // namespace

struct Recorder::Table : CsvWriter<detail::FrameRow> {
  using CsvWriter::CsvWriter;
};

Recorder::Recorder(fs::path directory, const SourceInfo& info)
    : directory_(std::move(directory)), pattern_(info.pattern) {
  make_empty_directory(directory_);
  const fs::path table = directory_ / detail::kFrameTableName;
  try {
    table_ =
        std::make_unique<Table>(table.string(), detail::frame_columns(), AppendFile::Mode::kNew);
  } catch (const Error&) {
    // Not even its header could be written: the directory can be used again.
    std::error_code ignored;
    if (fs::is_empty(table, ignored)) fs::remove(table, ignored);
    throw;
  }
}

Recorder::~Recorder() {
  std::error_code ignored;
  if (frames_ == 0) fs::remove(directory_ / detail::kFrameTableName, ignored);
}

void Recorder::write(const Frame& frame) {
  table_->add({write_image(frame), frame, pattern_});
  table_->flush();
  ++frames_;
}

// Returns the image file's name, empty where the frame has no image.
std::string Recorder::write_image(const Frame& frame) {
  if (!is_recordable(frame.image)) return {};
  std::string name = fmt::format("{:08}.png", frames_);
  // A stripe on a dark ground is mostly runs; higher levels cost much and gain little.
  static const std::vector<int> kFastest{cv::IMWRITE_PNG_COMPRESSION, 1};
  if (!cv::imencode(".png", frame.image, encoded_, kFastest)) fail(directory_ / name, EIO);
  write_whole_file(directory_ / name, encoded_);
  return name;
}

}  // namespace striper
