// SPDX-License-Identifier: Apache-2.0
#include "core/atomic_file.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <striper/core/error.hpp>

namespace striper::detail {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, int reason) {
  throw Error(ErrorKind::kIo,
              fmt::format("{}: cannot be written: {}", path.string(), std::strerror(reason)));
}

class Descriptor {
 public:
  explicit Descriptor(int fd) noexcept : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  int get() const noexcept { return fd_; }

  // Some file systems tell of a full disk only now.
  int close() noexcept { return ::close(std::exchange(fd_, -1)); }

 private:
  int fd_;
};

// 0, or why not all of it could be written.
int write_all(int fd, std::string_view content) noexcept {
  while (!content.empty()) {
    const ssize_t written = ::write(fd, content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    content.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

void write_straight(const fs::path& path, std::string_view content) {
  const Descriptor file(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
  if (file.get() < 0) fail(path, errno);
  if (const int reason = write_all(file.get(), content)) fail(path, reason);
}

// The permissions of the file that is replaced, else those of any new file.
mode_t permissions_for(const fs::path& path) noexcept {
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0) return status.st_mode & 07777U;
  const mode_t mask = ::umask(0);
  ::umask(mask);
  return 0666U & ~mask;
}

void flush_directory(const fs::path& directory) noexcept {
  const Descriptor opened(::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (opened.get() >= 0) ::fsync(opened.get());
}

}  // namespace

void write_file_atomically(const fs::path& path, std::string_view content) {
  std::error_code error;
  const fs::path target = fs::weakly_canonical(path, error);
  if (error) fail(path, error.value());
  if (fs::is_directory(target, error)) fail(path, EISDIR);
  if (fs::exists(target, error) && !fs::is_regular_file(target, error)) {
    write_straight(target, content);
    return;
  }
  const fs::path directory = target.has_parent_path() ? target.parent_path() : fs::path(".");
  std::string temporary =
      (directory / fmt::format(".{}.XXXXXX", target.filename().string())).string();
  Descriptor file(::mkostemp(temporary.data(), O_CLOEXEC));
  if (file.get() < 0) fail(path, errno);
  const auto give_up = [&](int reason) {
    ::unlink(temporary.c_str());
    fail(path, reason);
  };
  if (const int reason = write_all(file.get(), content)) give_up(reason);
  if (::fchmod(file.get(), permissions_for(target)) != 0) give_up(errno);
  if (::fsync(file.get()) != 0) give_up(errno);
  if (file.close() != 0) give_up(errno);
  if (::rename(temporary.c_str(), target.c_str()) != 0) give_up(errno);
  flush_directory(directory);
}

}  // namespace striper::detail
