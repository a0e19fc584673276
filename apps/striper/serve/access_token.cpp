// SPDX-License-Identifier: Apache-2.0
#include "serve/access_token.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <striper/core/error.hpp>

#include "serve/state_folder.hpp"

namespace striper::program {
namespace {

constexpr std::size_t kLeastLength = 16;
constexpr std::size_t kMostLength = 512;

[[noreturn]] void fail(const std::filesystem::path& path, const char* what, int error) {
  throw Error(ErrorKind::kIo, fmt::format("token '{}': {}: {}", path.string(), what,
                                          std::generic_category().message(error)));
}

std::string random_token() {
  std::array<unsigned char, 32> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw Error(ErrorKind::kIo, "token: the system gives no random numbers");
  }
  std::string text;
  for (const unsigned char byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

// Never over a file that is there: two programs that start together agree on the first one's.
bool make(const std::filesystem::path& path) {
  std::error_code ignored;
  std::filesystem::create_directories(path.parent_path(), ignored);
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (file < 0 && errno == EEXIST) return false;
  if (file < 0) fail(path, "it cannot be made", errno);
  const std::string line = random_token() + "\n";
  const bool is_written = ::write(file, line.data(), line.size()) == std::ssize(line);
  const int error = errno;
  ::close(file);
  if (is_written) return true;
  ::unlink(path.c_str());
  fail(path, "it cannot be written", error);
}

std::string read(const std::filesystem::path& path) {
  struct stat about {};
  if (::stat(path.c_str(), &about) != 0) fail(path, "it cannot be read", errno);
  if ((about.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    throw Error(ErrorKind::kBadFile,
                fmt::format("token '{}': others may read it: chmod 600", path.string()));
  }
  std::ifstream file(path);
  std::string token;
  if (!std::getline(file, token) && !file.eof()) fail(path, "it cannot be read", errno);
  const auto is_plain = [](char c) { return c > ' ' && c < 0x7f && c != ';' && c != ','; };
  const bool is_good = token.size() >= kLeastLength && token.size() <= kMostLength &&
                       std::all_of(token.begin(), token.end(), is_plain);
  if (is_good) return token;
  throw Error(ErrorKind::kBadFile,
              fmt::format("token '{}': its first line is no secret of {} to {} letters and digits; "
                          "without the file a new one is made",
                          path.string(), kLeastLength, kMostLength));
}

}  // namespace

std::string access_token(const std::optional<std::filesystem::path>& file,
                         const EventPort& events) {
  const std::filesystem::path folder = state_folder();
  if (!file && folder.empty()) {
    events.send({"token_missing", "there is no folder for the secret that changing something needs",
                 "--token FILE says where it is"});
    return {};
  }
  const std::filesystem::path path = file.value_or(folder / "token");
  try {
    if (make(path)) {
      events.send({"token_made", fmt::format("whoever changes something over the network shows the "
                                             "secret in {}",
                                             path.string())});
    }
    return read(path);
  } catch (const Error& error) {
    if (file || error.kind() != ErrorKind::kIo) throw;
    events.send({"token_missing", error.what(), "--token FILE says where it is"});
    return {};
  }
}

}  // namespace striper::program
