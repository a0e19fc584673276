// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace striper {

enum class ControlType {
  kNumber,  ///< One number.
  kSwitch,  ///< `on` (1) or `off` (0).
  kRegion,  ///< left, top, width, height: sensor pixels.
  kPose,    ///< x_m, y_m, z_m, roll_deg, pitch_deg, yaw_deg; world frame, REP 103.
};

/// The numbers of a control's value; a switch is 0 or 1.
using ControlValue = std::vector<double>;

/// How many numbers a value of this type has.
std::size_t control_size(ControlType type) noexcept;

/// A value as text: `20.5`, `on`, `0,0,640,480`; numbers round-trip.
std::string format_control(ControlType type, const ControlValue& value);

/// The same backwards. @throws Error{kBadValue} quoting text and what was expected.
ControlValue parse_control(ControlType type, std::string_view text);

/// What a control is now.
struct ControlState {
  ControlValue value;
  ControlValue minimum;  ///< Of each number; may be infinite.
  ControlValue maximum;
  bool is_writable = true;  ///< May depend on the moment: a region while nothing streams.
};

/// One control of a source, as it was asked for.
struct Control {
  std::string name;  ///< `exposure_us`, `gain_db`, `laser`, `region`, `sim.pose.NAME`.
  ControlType type = ControlType::kNumber;
  std::string unit;  ///< `us`, `dB`, `px`; empty where there is none.
  ControlState state;
};

/// How one control is read and written: a row of a source's table. To add a control is to add one.
struct ControlRow {
  std::string name;
  ControlType type = ControlType::kNumber;
  std::string unit;
  /// The state now; an empty value where this source does not have the control after all.
  /// @throws Error{kDevice} where the device does not answer.
  std::function<ControlState()> read;
  /// Writes a value within the bounds. Empty: it can only be read.
  /// @throws Error{kDevice} where the device refuses.
  std::function<void(const ControlValue&)> write;
};

/// What can be set on a source while it runs. Files have none.
///
/// Thread-safe, while the source streams too: one call at a time. A value holds from one of the
/// next frames on; which one depends on the device.
class Controls {
 public:
  Controls();  ///< None.
  /// @param source for messages: "sim:room.yaml".
  Controls(std::string source, std::vector<ControlRow> rows);
  Controls(Controls&&) noexcept;
  Controls& operator=(Controls&&) noexcept;
  ~Controls();

  /// Those that the source has now, in the order of its table. @throws Error{kDevice}.
  std::vector<Control> list() const;

  /// @throws Error{kUsage} for a name that it does not have, naming those that it has;
  ///         Error{kDevice}.
  Control get(std::string_view name) const;

  /// Sets a value and reads it back: what the device made of it.
  /// @throws Error as `get`; Error{kBadValue} naming control, value and range, Error{kUnsupported}
  ///         for one that cannot be set now, Error{kDevice} where the device refuses.
  Control set(std::string_view name, const ControlValue& value);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace striper
