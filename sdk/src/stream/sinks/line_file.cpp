// SPDX-License-Identifier: Apache-2.0
#include "stream/sinks/line_file.hpp"

#include <cerrno>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <striper/core/error.hpp>

namespace striper::detail {
namespace {

constexpr mode_t kNewFileMode = 0644;

}  // namespace

LineFile::LineFile(std::string path)
    : path_(std::move(path)),
      file_(path_ == "-"
                ? STDOUT_FILENO
                : ::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kNewFileMode)) {
  if (file_ < 0) fail("write", errno);
}

LineFile::~LineFile() {
  if (file_ > STDERR_FILENO) ::close(file_);
}

void LineFile::write(std::string_view lines) {
  std::size_t done = 0;
  while (done < lines.size()) {
    const ssize_t count = ::write(file_, lines.data() + done, lines.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      const int reason = errno;
      cut_back(lines, done);
      fail("write", reason);
    }
    done += static_cast<std::size_t>(count);
  }
}

// Counted from where the file stands, since the standard output may go to the end of a file; a
// pipe cannot be cut.
void LineFile::cut_back(std::string_view lines, std::size_t done) const {
  const std::size_t last_end = done == 0 ? std::string_view::npos : lines.rfind('\n', done - 1);
  const std::size_t whole = last_end == std::string_view::npos ? 0 : last_end + 1;
  const off_t end = ::lseek(file_, 0, SEEK_CUR);
  const auto excess = static_cast<off_t>(done - whole);
  if (excess > 0 && end >= excess) {
    [[maybe_unused]] const int ignored = ::ftruncate(file_, end - excess);
  }
}

void LineFile::close() {
  if (file_ <= STDERR_FILENO) return;
  if (::close(std::exchange(file_, -1)) != 0) fail("finish", errno);
}

void LineFile::fail(const char* action, int reason) const {
  throw Error(ErrorKind::kIo,
              fmt::format("cannot {} '{}': {}", action, path_ == "-" ? "standard output" : path_,
                          std::generic_category().message(reason)),
              reason);
}

}  // namespace striper::detail
