// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

// Aravis is C: its macros use old-style casts and variadics that our warnings would see.
#include <arv.h>

namespace striper::detail {

struct Unref {
  template <typename T>
  void operator()(T* object) const noexcept {
    g_object_unref(object);
  }
};

/// Owns one reference to a GObject.
template <typename T>
using GPtr = std::unique_ptr<T, Unref>;

template <typename T>
GPtr<T> share(T* object) {
  return GPtr<T>(static_cast<T*>(g_object_ref(object)));
}

/// Receives the error of one Aravis call.
class CallError {
 public:
  CallError() = default;
  CallError(const CallError&) = delete;
  CallError& operator=(const CallError&) = delete;
  ~CallError() { g_clear_error(&error_); }

  /// To be handed to the call; forgets an earlier error.
  GError** slot() noexcept {
    g_clear_error(&error_);
    return &error_;
  }
  explicit operator bool() const noexcept { return error_ != nullptr; }
  int code() const noexcept { return error_ != nullptr ? error_->code : 0; }
  std::string message() const { return error_ != nullptr ? error_->message : std::string(); }

 private:
  GError* error_ = nullptr;
};

}  // namespace striper::detail
