#pragma once
// The forms of a message. CDR is OMG XCDR version 1, little endian, with its four-byte encapsulation header,
// as ROS 2 puts it on the wire. YAML is what `ros2 topic echo` prints and `ros2 topic pub` reads.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/core/status.h"
#include "doppel/messages/message.h"

namespace doppel {

using Bytes = std::vector<std::byte>;

// Size of the CDR form, header included. Allocates nothing.
template <Message M>
std::size_t cdr_size(const M& message);

// Writes the CDR form; returns its size, or 0 if `out` is too small. Allocates nothing.
template <Message M>
std::size_t write_cdr(const M& message, std::span<std::byte> out);

template <Message M>
Bytes to_cdr(const M& message);

// Refuses what is truncated, over-long, of an unknown encapsulation, or claims more elements than it has
// bytes; bounded memory whatever the bytes. Reads both byte orders.
template <Message M>
Status from_cdr(std::span<const std::byte> bytes, M& message);

// Type-erased forms of one registered message type, for edges and the command line.
struct TypeSupport {
  std::string name;         // "sensor_msgs/msg/JointState"
  std::string (*schema)();  // "ros2msg" text: the definition, then "===\nMSG: pkg/Name" dependencies
  Status (*yaml_to_cdr)(std::string_view yaml,
                        Bytes& out);  // unknown keys refused with the nearest field and place
  Status (*cdr_to_yaml)(std::span<const std::byte> cdr, std::string& out);
  Status (*cdr_to_json)(std::span<const std::byte> cdr, std::string& out);
};

struct ServiceSupport {
  std::string name;  // "std_srvs/srv/Trigger"
  const TypeSupport* request;
  const TypeSupport* response;
};

struct ActionSupport {
  std::string name;  // "control_msgs/action/FollowJointTrajectory"
  const TypeSupport *goal, *result, *feedback;
};

// Names in the long ("sensor_msgs/msg/JointState") or short form ("sensor_msgs/JointState"); nullptr:
// unknown.
const TypeSupport* find_type(std::string_view name);
const ServiceSupport* find_service(std::string_view name);
const ActionSupport* find_action(std::string_view name);
std::vector<std::string> type_names();  // messages only, long form, sorted
std::vector<std::string> service_names();
std::vector<std::string> action_names();

template <Message M>
const TypeSupport& type_support();

}  // namespace doppel

#include "doppel/messages/codec_detail.h"
