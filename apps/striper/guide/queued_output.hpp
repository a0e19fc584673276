// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "guide/guidance_output.hpp"

namespace striper::program {

/// Another output on a thread of its own: a pipe that nobody empties, a terminal that stands still,
/// a disk that sleeps hold guidance up no longer than it lets them, and never against Ctrl-C.
///
/// What the other one throws comes out of the next call, with `kDrop` of `finish` alone. Told from
/// one thread.
class QueuedOutput : public GuidanceOutput {
 public:
  enum class WhenFull {
    kWait,  ///< Until there is room or the program is told to end: a recorded run loses nothing.
    kDrop,  ///< What has no room is lost and counted: a truck drives on.
  };
  /// Makes the other one, on the thread: what it is made of must live as long as the program.
  using Open = std::function<std::unique_ptr<GuidanceOutput>()>;

  /// Returns once the other one is open; says so where it waits: a pipe opens when somebody reads
  /// it.
  /// @param address of the other one, for messages. @throws what opening throws; Error{kIo} where
  /// the program is told to end before.
  QueuedOutput(const std::string& address, Open open, WhenFull when_full);
  ~QueuedOutput() override;

  void lateral(const LateralLine& line) override;
  void switch_gun(std::size_t gun, bool is_on, double time_s) override;
  void gun(const GunLine& line) override;
  void seen(const SeenLine& line) override;
  void fault(const FaultLine& line) override;
  void switch_laser_off(double time_s) override;

  /// Waits for the other one; of a program that is told to end, and with `kDrop`, .2 s at most.
  void finish() override;
  Account account() const override;

 private:
  struct Desk;
  template <typename Told>
  void tell(const Told& told);
  void wait_until_open(const std::string& address);
  void leave_behind();

  std::shared_ptr<Desk> desk_;  // The thread's, too: it may outlive this.
  WhenFull when_full_;
  bool is_finished_ = false;
  std::thread thread_;
};

}  // namespace striper::program
