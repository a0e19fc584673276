// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "dds_domain.hpp"

namespace striper::detail {

/// A writer or reader that was heard of, with the program it belongs to.
struct RosEndpoint {
  std::string topic;  ///< As in DDS: "rt/striper/points".
  std::string type;
  std::string user_data;  ///< "typehash=RIHS01_...;" of Iron and later.
  dds_guid_t participant{};
};

/// Who writes or reads what in a domain, as its programs announce it; this one aside.
class RosGraph {
 public:
  enum class Side { kWriters, kReaders };
  RosGraph(const DdsParticipant& participant, Side side);

  /// Those that were heard of since the last call.
  std::vector<RosEndpoint> take_new();

 private:
  dds_guid_t own_;
  DdsEntity reader_;
};

}  // namespace striper::detail
