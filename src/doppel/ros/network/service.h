#pragma once
// Services as in rmw_fastrtps: a topic of requests and one of replies, related by the sample's identity. A
// client writes the Gid of its reply reader as the request's related identity, so that a server can wait for
// that reader. Server and client of the same participant do not match.

#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "doppel/export.h"
#include "doppel/ros/network/participant.h"

namespace doppel::ros2 {

struct ServiceSpec {
  std::string name;  // "/controller_manager/list_controllers"
  std::string type;  // "controller_manager_msgs/srv/ListControllers"
  // Of the types <type>_Request and <type>_Response, which the endpoints announce.
  std::string request_hash, response_hash;
  QosProfile qos = services_qos();
};

class DOPPEL_API ServiceServer {
 public:
  ServiceServer(Participant& participant, const ServiceSpec& spec);

  [[nodiscard]] const Reader& requests() const { return *requests_; }
  [[nodiscard]] const Writer& replies() const { return *replies_; }
  // Sets `request.related` to the identity that respond() needs.
  bool take(Sample& request);
  enum class Sent { yes, client_gone, not_yet_matched, not_yet_in_step };
  enum class When { matched, in_step };
  // not_yet_matched: the client's reader is not known yet, or the writer's history is full; not_yet_in_step:
  // it is known, but may not have found this server's writer (Writer::is_in_step). Both: to be repeated soon
  // (rmw_fastrtps waits up to 100 ms for the match only).
  Sent respond(const SampleIdentity& to, std::span<const std::byte> cdr, When when = When::matched);

 private:
  void remember(const Gid& reply_reader, const Gid& request_writer);

  std::unique_ptr<Reader> requests_;
  std::unique_ptr<Writer> replies_;
  std::map<Gid, Gid> clients_;  // from reply reader to request writer, one for each client
};

class DOPPEL_API ServiceClient {
 public:
  ServiceClient(Participant& participant, const ServiceSpec& spec);

  [[nodiscard]] const Writer& requests() const { return *requests_; }
  [[nodiscard]] const Reader& replies() const { return *replies_; }
  // True if a server is matched in both directions.
  [[nodiscard]] bool is_available() const;
  // The request's sequence number; nullopt if it could not be sent.
  std::optional<std::int64_t> send(std::span<const std::byte> cdr);
  // Takes a reply to one of this client's requests; its number is reply.related.sequence.
  bool take(Sample& reply);

 private:
  std::unique_ptr<Writer> requests_;
  std::unique_ptr<Reader> replies_;
};

}  // namespace doppel::ros2
