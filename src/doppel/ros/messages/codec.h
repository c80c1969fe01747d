#pragma once
// The encodings of a message. CDR is OMG XCDR version 1, little endian, with its four-byte encapsulation
// header, as on the wire in ROS 2. YAML is the format of `ros2 topic echo` and `ros2 topic pub`.

#include <array>
#include <cstddef>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "doppel/base/core/status.h"
#include "doppel/export.h"
#include "doppel/ros/messages/distro.h"
#include "doppel/ros/messages/message.h"

namespace doppel {

using Bytes = std::vector<std::byte>;
struct TypeDescription;

// Size of the CDR form in bytes, including the header. Does not allocate.
template <Message M>
std::size_t cdr_size(const M& message);

// Writes the CDR form; returns its size, or 0 if `out` is too small. Does not allocate.
template <Message M>
std::size_t write_cdr(const M& message, std::span<std::byte> out);

template <Message M>
Bytes to_cdr(const M& message);

// Refuses bytes that are truncated, too long (except for RTPS's padding to a multiple of four bytes), of an
// unknown encapsulation, or with more elements than bytes; for any input the memory is proportional to its
// size. Reads both byte orders. After a refusal `message` contains a part of the data.
template <Message M>
Status from_cdr(std::span<const std::byte> bytes, M& message);

// A text that is made at the first request; any thread.
class LazyText {
 public:
  template <class Make>
  const std::string& get(Make make) const {
    std::call_once(once_, [&] { text_ = make(); });
    return text_;
  }

 private:
  mutable std::once_flag once_;
  mutable std::string text_;
};
using TextPerDistro = std::array<LazyText, kDistros>;

// Type-erased encodings of one message type, for edges and the command line: of a struct (type_support<M>())
// or of a received description (ros/messages/described_type.h). Any thread.
class DOPPEL_API TypeSupport {
 public:
  explicit TypeSupport(std::string type_name) : name(std::move(type_name)) {}
  virtual ~TypeSupport() = default;
  TypeSupport(const TypeSupport&) = delete;
  TypeSupport& operator=(const TypeSupport&) = delete;

  const std::string name;  // "sensor_msgs/msg/JointState"

  // "ros2msg" text: the definition, then "===\nMSG: pkg/Name" dependencies
  [[nodiscard]] std::string schema() const;
  // As in `ros2 topic pub`: omitted fields keep their defaults, "auto" for a header and "now" for a time
  // leave the stamp zero. ROS 1's secs and nsecs are accepted for times. Refuses unknown keys with the
  // nearest field and the place, "line:column: ...".
  Status yaml_to_cdr(std::string_view yaml, Bytes& out) const;
  // JSON (RFC 8259) by the same rules, many times faster; null is an omitted value only as the whole text.
  Status json_to_cdr(std::string_view json, Bytes& out) const;
  Status cdr_to_yaml(std::span<const std::byte> cdr, std::string& out) const;
  // Compact. JSON has no NaN and no infinities: they become null; bytes that are not UTF-8 become U+FFFD.
  Status cdr_to_json(std::span<const std::byte> cdr, std::string& out) const;
  // The hash in this process's distribution, or in another one; ros/messages/type_hash.h.
  [[nodiscard]] const std::string& hash(Distro distro = ros_distro()) const;

  // Checked, little endian, without padding.
  Status recode(std::span<const std::byte> cdr, Bytes& out) const;

  // The fields in this process's distribution; ros/messages/type_description.h.
  [[nodiscard]] const TypeDescription* description() const { return description_in(ros_distro()); }
  [[nodiscard]] virtual const TypeDescription* description_in(Distro distro) const = 0;

 private:
  TextPerDistro hashes_;
};

struct DOPPEL_API ServiceSupport {
  std::string name;  // "std_srvs/srv/Trigger"
  const TypeSupport* request;
  const TypeSupport* response;
  TextPerDistro late_hashes = {};

  [[nodiscard]] const std::string& hash() const;
};

struct DOPPEL_API ActionSupport {
  std::string name;  // "control_msgs/action/FollowJointTrajectory"
  const TypeSupport *goal, *result, *feedback;
  TextPerDistro late_hashes = {};

  [[nodiscard]] const std::string& hash() const;
};

// Names in the long ("sensor_msgs/msg/JointState") or short form ("sensor_msgs/JointState");
// nullptr: unknown. find_type also finds the parts of services and actions, and the events of services
// ("std_srvs/srv/Trigger_Request", "std_srvs/srv/Trigger_Event"). Any thread.
DOPPEL_API const TypeSupport* find_type(std::string_view name);
DOPPEL_API const ServiceSupport* find_service(std::string_view name);
DOPPEL_API const ActionSupport* find_action(std::string_view name);
DOPPEL_API std::vector<std::string> type_names();  // messages only, long form, sorted
DOPPEL_API std::vector<std::string> service_names();
DOPPEL_API std::vector<std::string> action_names();

// Register types of other libraries; the bus does so for all advertised, subscribed and served types.
DOPPEL_API void register_type(const TypeSupport& type);
DOPPEL_API void register_service(const ServiceSupport& service);
DOPPEL_API void register_action(const ActionSupport& action);

template <Message M>
const TypeSupport& type_support();
template <Service S>
const ServiceSupport& service_support();
template <Action A>
const ActionSupport& action_support();

}  // namespace doppel

#include "doppel/ros/messages/detail/codec.h"
