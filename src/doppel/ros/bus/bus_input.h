#pragma once
// The requests of others to the loop, as values. The bus hands each one to an observer right before the
// loop acts on it (Bus::observe_inputs), so that a run can be written down and run again.

#include <cstdint>
#include <string>

#include "doppel/ros/messages/codec.h"

namespace doppel {

struct BusInput {
  enum class Kind : std::uint8_t {
    message,    // from a publisher behind an edge to a topic that nodes read; data: CDR
    call,       // of a service; data: CDR of the request
    parameter,  // of a node is set; data: CDR of a rcl_interfaces/msg/ParameterValue
    outcome,    // work that ran on another thread is complete (Bus::complete); no data
    edit,       // of files, with which the run continues; data: CDR of a doppel_msgs/msg/EditedFiles
  };
  Kind kind = Kind::message;
  std::string source;  // of a message: the publisher's node
  std::string target;  // the topic, the service, the node, the work
  std::string type;    // of a message: its type; of a parameter: its name
  Bytes data;
};

}  // namespace doppel
