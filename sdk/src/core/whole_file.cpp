// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <striper/core/error.hpp>
#include <striper/core/whole_file.hpp>

namespace striper {
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

  // 0, or why not: some file systems tell of a full disk only now.
  int close() noexcept { return ::close(std::exchange(fd_, -1)) == 0 ? 0 : errno; }

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

// Makes a file beside `target` under a name that nobody has, with the permissions of any new file.
// mkostemp() would make it private, and to learn the umask one has to change it under other
// threads.
std::pair<fs::path, int> create_beside(const fs::path& target) {
  static std::atomic<unsigned> counter{0};
  constexpr int kTries = 100;
  int fd = -1;
  fs::path path;
  for (int i = 0; i < kTries && fd < 0; ++i) {
    path = target.parent_path() /
           fmt::format(".{}.{}.{}", target.filename().string(), ::getpid(), counter++);
    fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd < 0 && errno != EEXIST) break;
  }
  return {path, fd};
}

// The file that is replaced keeps its permissions. 0, or why not.
int copy_permissions(const fs::path& from, int fd) noexcept {
  struct stat status {};
  if (::stat(from.c_str(), &status) != 0) return 0;
  return ::fchmod(fd, status.st_mode & 07777U) == 0 ? 0 : errno;
}

void flush_directory_of(const fs::path& target) noexcept {
  const fs::path directory = target.has_parent_path() ? target.parent_path() : fs::path(".");
  const Descriptor opened(::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (opened.get() >= 0) ::fsync(opened.get());
}

// Whether there is something that cannot be replaced by a file: a pipe, a device. Not asked of
// what links say: that of an open pipe, as in /dev/stdout, names no file.
bool is_special(const fs::path& path) noexcept {
  std::error_code ignored;
  return fs::exists(path, ignored) && !fs::is_regular_file(path, ignored) &&
         !fs::is_directory(path, ignored);
}

// The file that the path leads to in the end, which need not be there; refused where it is a
// directory.
fs::path target_of(const fs::path& path) {
  constexpr int kMostLinks = 40;  // As many as Linux follows.
  if (path.empty()) fail(path, ENOENT);
  std::error_code error;
  if (fs::is_directory(path, error)) fail(path, EISDIR);
  fs::path target = path;
  for (int links = 0; fs::is_symlink(target, error); ++links) {
    if (links == kMostLinks) fail(path, ELOOP);
    const fs::path next = fs::read_symlink(target, error);
    if (error) fail(path, error.value());
    target = target.parent_path() / next;  // An absolute one replaces what it is appended to.
  }
  return target;
}

}  // namespace

std::string read_text_file(const std::filesystem::path& path, std::string_view expected) {
  constexpr std::size_t kMostBytes = std::size_t{16} << 20;
  const auto fail = [&](ErrorKind kind, std::string_view what) {
    throw Error(kind, fmt::format("{}: {} - expected {}", path.string(), what, expected));
  };
  const auto fail_to_read = [&](int reason) {
    fail(ErrorKind::kIo,
         fmt::format("cannot be read: {}", std::generic_category().message(reason)));
  };
  std::error_code failure;
  const bool is_there = std::filesystem::exists(path, failure);
  if (failure) fail_to_read(failure.value());
  if (!is_there) fail(ErrorKind::kNotFound, "there is no such file");
  if (std::filesystem::is_directory(path, failure)) fail(ErrorKind::kBadFile, "is a directory");
  std::ifstream file(path, std::ios::binary);
  if (!file) fail_to_read(errno);
  std::string text(kMostBytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad()) fail_to_read(errno);
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > kMostBytes)
    fail(ErrorKind::kBadFile, fmt::format("is larger than {} MiB", kMostBytes >> 20));
  return text;
}

void write_file_atomically(const fs::path& path, std::string_view content) {
  if (is_special(path)) {
    write_straight(path, content);
    return;
  }
  const fs::path target = target_of(path);
  const auto [temporary, fd] = create_beside(target);
  Descriptor file(fd);
  if (fd < 0) fail(path, errno);
  int reason = write_all(fd, content);
  if (reason == 0) reason = copy_permissions(target, fd);
  if (reason == 0 && ::fsync(fd) != 0) reason = errno;
  if (const int failure = file.close(); reason == 0) reason = failure;
  if (reason == 0 && ::rename(temporary.c_str(), target.c_str()) != 0) reason = errno;
  if (reason != 0) {
    ::unlink(temporary.c_str());
    fail(path, reason);
  }
  flush_directory_of(target);
}

void require_writable(const fs::path& path) {
  if (is_special(path)) {
    if (::access(path.c_str(), W_OK) != 0) fail(path, errno);
    return;
  }
  const auto [temporary, fd] = create_beside(target_of(path));
  const Descriptor file(fd);
  if (fd < 0) fail(path, errno);
  ::unlink(temporary.c_str());
}

void require_replaceable(const fs::path& path, std::initializer_list<std::string_view> beginnings,
                         std::string_view kind) {
  std::error_code ignored;
  const bool is_stream = path == "-" || path.native().starts_with("/dev/");
  if (is_stream || !fs::is_regular_file(path, ignored)) return;
  std::size_t longest = 0;
  for (const std::string_view one : beginnings) longest = std::max(longest, one.size());
  std::ifstream file(path, std::ios::binary);
  if (!file.is_open())
    throw Error(
        ErrorKind::kUsage,
        fmt::format("'{}' is there and cannot be read, so it is not overwritten; remove it, "
                    "or name another file",
                    path.string()));
  std::string begin(longest, '\0');
  file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<std::size_t>(file.gcount()));
  const auto fits = [&](std::string_view one) {
    return begin.starts_with(one) || one.starts_with(begin);
  };
  if (std::any_of(beginnings.begin(), beginnings.end(), fits)) return;
  throw Error(ErrorKind::kUsage,
              fmt::format("'{}' is there and holds no {}: it is not overwritten; remove it, or "
                          "name another file",
                          path.string(), kind));
}

}  // namespace striper
