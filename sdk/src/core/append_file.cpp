// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <striper/core/append_file.hpp>
#include <striper/core/error.hpp>

namespace striper {
namespace {

constexpr mode_t kNewFileMode = 0666;  // Less what the umask says.

// How much of these bytes is whole lines.
std::size_t whole_lines(std::string_view bytes) {
  const std::size_t last_end = bytes.rfind('\n');
  return last_end == std::string_view::npos ? 0 : last_end + 1;
}

}  // namespace

AppendFile::AppendFile(std::string path, Mode mode) : path_(std::move(path)) {
  const int flags = mode == Mode::kNew ? O_EXCL | O_APPEND : O_TRUNC;
  file_ = path_ == "-"
              ? STDOUT_FILENO
              : ::open(path_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | flags, kNewFileMode);
  if (file_ < 0) fail("write", errno);
}

AppendFile::~AppendFile() {
  if (file_ > STDERR_FILENO) ::close(file_);
}

void AppendFile::fail(const char* action, int error) const {
  throw Error(ErrorKind::kIo,
              fmt::format("cannot {} {}: {}", action,
                          path_ == "-" ? "'standard output'" : "'" + path_ + "'",
                          std::generic_category().message(error)),
              error);
}

void AppendFile::flush() {
  try {
    write(lines_, /*keeps_lines=*/true);
  } catch (...) {
    lines_.clear();
    throw;
  }
  lines_.clear();
}

void AppendFile::append(std::string_view bytes) { write(bytes, /*keeps_lines=*/false); }

void AppendFile::write(std::string_view bytes, bool keeps_lines) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = ::write(file_, bytes.data() + done, bytes.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      const int error = count < 0 ? errno : ENOSPC;
      cut_off(keeps_lines ? done - whole_lines(bytes.substr(0, done)) : done);
      fail("write", error);
    }
    done += static_cast<std::size_t>(count);
  }
}

// Counted from where the file stands, since the standard output may have been redirected to the end
// of a file; a pipe cannot be cut, its reader has had what there was. Where even this fails the
// reader finds the cut.
void AppendFile::cut_off(std::size_t excess) noexcept {
  const off_t end = ::lseek(file_, 0, SEEK_CUR);
  const auto whole = end - static_cast<off_t>(excess);
  if (excess > 0 && whole >= 0 && ::ftruncate(file_, whole) == 0) ::lseek(file_, whole, SEEK_SET);
}

void AppendFile::close() {
  if (file_ < 0) return;
  flush();
  const int file = std::exchange(file_, -1);
  if (file > STDERR_FILENO && ::close(file) != 0) fail("finish", errno);
}

}  // namespace striper
