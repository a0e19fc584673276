// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include <dds/dds.h>

#include "ros2_address.hpp"

namespace striper::detail {

using DdsQos = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;

/// An entity of Cyclone DDS, with all that was made in it gone when it is. Thread-safe, as they
/// are.
class DdsEntity {
 public:
  /// @throws Error{kIo} where the handle says that it failed: what, and Cyclone's own word.
  DdsEntity(dds_entity_t handle, const std::string& what);
  DdsEntity(const DdsEntity&) = delete;
  DdsEntity& operator=(const DdsEntity&) = delete;
  ~DdsEntity();

  dds_entity_t handle() const noexcept { return handle_; }
  dds_guid_t guid() const;

 private:
  dds_entity_t handle_;
};

/// This process in a domain. Two addresses of one domain share it, with the first one's interface:
/// a process has one of each.
class DdsParticipant {
 public:
  /// @throws Error{kIo} where there is no such interface, or it is down.
  explicit DdsParticipant(const Ros2Address& address);

  dds_entity_t handle() const noexcept { return participant_.handle(); }
  dds_guid_t guid() const;

  /// Says that the program is one of ROS 2's, in its nameless security enclave.
  void claim_enclave() const;

 private:
  std::shared_ptr<const DdsEntity> domain_;
  DdsEntity participant_;
};

}  // namespace striper::detail
