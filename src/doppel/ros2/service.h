#pragma once
// Services as rmw_fastrtps carries them: a topic of requests and one of replies, joined by the sample's
// identity. A client writes its reply reader's Gid as the request's related identity, so that a server knows
// whom to wait for. Server and client in one participant do not meet.

#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "doppel/export.h"
#include "doppel/ros2/participant.h"

namespace doppel::ros2 {

struct ServiceSpec {
  std::string name;  // "/controller_manager/list_controllers"
  std::string type;  // "controller_manager_msgs/srv/ListControllers"
  // Of the types <type>_Request and <type>_Response: the endpoints carry messages, so that is what they tell.
  std::string request_hash, response_hash;
  QosProfile qos = services_qos();
};

class DOPPEL_API ServiceServer {
 public:
  ServiceServer(Participant& participant, const ServiceSpec& spec);

  [[nodiscard]] const Reader& requests() const { return *requests_; }
  [[nodiscard]] const Writer& replies() const { return *replies_; }
  // `request.related` is made what respond() wants.
  bool take(Sample& request);
  enum class Sent { yes, client_gone, not_yet_matched, not_yet_in_step };
  enum class When { matched, in_step };
  // not_yet_matched: the client's reader is not known yet, or the writer has no room for the moment;
  // not_yet_in_step: it is known, but may not have found this server's writer (Writer::is_in_step). Try again
  // soon (rmw_fastrtps waits up to 100 ms for the match, and for no more than that).
  Sent respond(const SampleIdentity& to, std::span<const std::byte> cdr, When when = When::matched);

 private:
  void remember(const Gid& reply_reader, const Gid& request_writer);

  std::unique_ptr<Reader> requests_;
  std::unique_ptr<Writer> replies_;
  std::map<Gid, Gid> clients_;  // reply reader to request writer, of those who have asked; one for each
};

class DOPPEL_API ServiceClient {
 public:
  ServiceClient(Participant& participant, const ServiceSpec& spec);

  [[nodiscard]] const Writer& requests() const { return *requests_; }
  [[nodiscard]] const Reader& replies() const { return *replies_; }
  // Whether one server is there that would get a request and could answer it.
  [[nodiscard]] bool is_available() const;
  // The request's number, nothing if it could not be sent.
  std::optional<std::int64_t> send(std::span<const std::byte> cdr);
  // An answer to one of this client's own requests; its number is reply.related.sequence.
  bool take(Sample& reply);

 private:
  std::unique_ptr<Writer> requests_;
  std::unique_ptr<Reader> replies_;
};

}  // namespace doppel::ros2
