// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <striper/core/csv_file.hpp>
#include <striper/core/error.hpp>

namespace striper {
namespace {

constexpr mode_t kNewFileMode = 0644;

}  // namespace

CsvOutput::CsvOutput(std::string path, Mode mode) : path_(std::move(path)) {
  const int flags = mode == Mode::kNew ? O_EXCL | O_APPEND : O_TRUNC;
  file_ = path_ == "-"
              ? STDOUT_FILENO
              : ::open(path_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | flags, kNewFileMode);
  if (file_ < 0) fail("write", errno);
}

CsvOutput::~CsvOutput() {
  if (file_ > STDERR_FILENO) ::close(file_);
}

void CsvOutput::fail(const char* action, int error) const {
  throw Error(ErrorKind::kIo,
              fmt::format("cannot {} {}: {}", action,
                          path_ == "-" ? "'standard output'" : "'" + path_ + "'",
                          std::generic_category().message(error)),
              error);
}

void CsvOutput::flush() {
  try {
    write_lines();
  } catch (...) {
    lines_.clear();
    throw;
  }
  lines_.clear();
}

void CsvOutput::write_lines() {
  std::size_t done = 0;
  while (done < lines_.size()) {
    const ssize_t count = ::write(file_, lines_.data() + done, lines_.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      const int error = errno;
      cut_back_to_whole_lines(done);
      fail("write", error);
    }
    done += static_cast<std::size_t>(count);
  }
}

// What did not fit ends in half a line: takes that off again. Counted from where the file stands,
// since the standard output may have been redirected to the end of a file; a pipe cannot be cut,
// its reader has had what there was.
void CsvOutput::cut_back_to_whole_lines(std::size_t done) noexcept {
  const std::size_t last_end = done == 0 ? std::string::npos : lines_.rfind('\n', done - 1);
  const std::size_t whole = last_end == std::string::npos ? 0 : last_end + 1;
  const off_t end = ::lseek(file_, 0, SEEK_CUR);
  const auto excess = static_cast<off_t>(done - whole);
  if (excess > 0 && end >= excess) {
    [[maybe_unused]] const int ignored = ::ftruncate(file_, end - excess);
  }
}

void CsvOutput::close() {
  if (file_ < 0) return;
  flush();
  const int file = std::exchange(file_, -1);
  if (file > STDERR_FILENO && ::close(file) != 0) fail("finish", errno);
}

}  // namespace striper
