#include "doppel/ros/network/fastdds/fast_transport.h"

#include <algorithm>
#include <memory>

#include "doppel/ros/network/detail/rtps_gap.h"
#include "doppel/ros/network/fastdds/fast_addressing.h"
#include "doppel/ros/network/fastdds/fast_log.h"
#include "doppel/ros/network/fastdds/fast_ports.h"
#include "doppel/ros/network/participant.h"

namespace doppel::ros2::fast {
namespace {

using rtps::IPLocator;

constexpr const char* kLoopback = "127.0.0.1";
// The number of participants of one host that unicast discovery reaches, as in rmw_fastrtps.
constexpr std::uint32_t kPeersRange = 32;
// Limited by net.core.rmem_max; large, because an image arrives in bursts.
constexpr std::uint32_t kSocketBuffer = 4 * 1024 * 1024;
// Fast DDS fills a datagram up to its limit and then adds its statistics, which a receiver with the same
// limit cuts off; a datagram that is cut is refused, at every repetition.
constexpr std::uint32_t kRoomForStatistics = 128;  // bytes, in what this sends
constexpr std::uint32_t kLargestDatagram = 65536;  // bytes, of what this receives

rtps::Locator_t locator(const std::string& address, std::uint32_t port) {
  rtps::Locator_t result;
  IPLocator::setIPv4(result, address);
  result.port = port;
  return result;
}

// The treatment of peers' addresses in the transport.
enum class Reach { all, this_machine, nobody };

// UDP that drops invalid datagrams and, on request, stays on the machine. A ROS 2 process listens on all
// interfaces and announces their addresses; on this machine each of them can also be reached by loopback,
// which is the only route for a socket bound to 127.0.0.1.
class GuardedTransport : public TransportOfDatagrams {
 public:
  GuardedTransport(const transport::ChainingTransportDescriptor& descriptor, Reach reach,
                   std::shared_ptr<ReceiveGate> receive_gate)
      : TransportOfDatagrams(descriptor), reach_(reach), receive_gate_(std::move(receive_gate)) {}

  std::uint32_t max_recv_buffer_size() const override { return kLargestDatagram; }

  void receive(transport::TransportReceiverInterface* above, const rtps::octet* data, std::uint32_t size,
               const rtps::Locator_t& local, const rtps::Locator_t& remote) override {
    with_logged_exceptions([&] {
      if (reach_ == Reach::nobody) return;
      receive_gate_->receive({data, size}, [&](std::span<const std::uint8_t> admitted) {
        above->OnDataReceived(admitted.data(), static_cast<std::uint32_t>(admitted.size()), local, remote);
      });
    });
  }

 private:
  [[nodiscard]] std::optional<Mapping> mapping_of(const rtps::Locator_t& peer) const override {
    if (reach_ == Reach::all) return std::nullopt;
    if (reach_ == Reach::nobody || !IsLocatorSupported(peer) || !is_local_locator(peer)) return Mapping{};
    Mapping out{true, peer};
    IPLocator::setIPv4(out.place, kLoopback);
    return out;
  }

  bool send_datagram(Datagram& datagram, rtps::SenderResource& below, rtps::LocatorsIterator* begin,
                     rtps::LocatorsIterator* end, const SendDeadline& deadline) override {
    if (reach_ == Reach::nobody) return true;
    const AddressingScope* const addressee = AddressingScope::present();
    if (addressee == nullptr) return datagram.send(below, begin, end, deadline);
    Places to, others;
    for (; *begin != *end; ++*begin) (addressee->is_at(**begin) ? to : others).push_back(**begin);
    const auto without = without_samples(datagram.bytes(), addressee->writer());
    const bool told_apart = !to.empty() && !without.empty();
    if (!told_apart) to.insert(to.end(), others.begin(), others.end());
    bool sent = send_to(to, below, datagram, deadline);
    if (told_apart) {
      Datagram rest(without);
      sent = send_to(others, below, rest, deadline) && sent;
    }
    return sent;
  }

  static bool send_to(const Places& places, rtps::SenderResource& below, Datagram& datagram,
                      const SendDeadline& deadline) {
    transport::Locators begin(places.begin()), end(places.end());
    return places.empty() || datagram.send(below, &begin, &end, deadline);
  }

  Reach reach_;
  std::shared_ptr<ReceiveGate> receive_gate_;
};

class GuardedDescriptor : public transport::ChainingTransportDescriptor {
 public:
  GuardedDescriptor(std::shared_ptr<transport::TransportDescriptorInterface> below, Reach reach,
                    std::shared_ptr<ReceiveGate> receive_gate)
      : transport::ChainingTransportDescriptor(std::move(below)),
        reach_(reach),
        receive_gate_(std::move(receive_gate)) {}
  transport::TransportInterface* create_transport() const override {
    return new GuardedTransport(*this, reach_, receive_gate_);
  }

 private:
  Reach reach_;
  std::shared_ptr<ReceiveGate> receive_gate_;
};

std::shared_ptr<transport::TransportDescriptorInterface> guarded_transport(
    Reach reach, std::shared_ptr<ReceiveGate> receive_gate) {
  auto descriptor = std::make_shared<transport::UDPv4TransportDescriptor>();
  descriptor->maxMessageSize -= kRoomForStatistics;
  descriptor->maxInitialPeersRange = kPeersRange;
  descriptor->receiveBufferSize = kSocketBuffer;
  descriptor->sendBufferSize = kSocketBuffer;
  if (reach != Reach::all) descriptor->interfaceWhiteList = {kLoopback};
  return std::make_shared<GuardedDescriptor>(std::move(descriptor), reach, std::move(receive_gate));
}

DdsDuration duration(std::int64_t milliseconds) {
  return {static_cast<std::int32_t>(milliseconds / 1000),
          static_cast<std::uint32_t>(milliseconds % 1000 * 1'000'000)};
}

// A new peer may miss the response to its announcement (see ReceiveGate) and then waits for the
// next announcement. On this machine announcements are cheap, so they are more frequent than Fast
// DDS's three seconds.
void set_announcements(const ParticipantOptions& options, bool stays_here, rtps::BuiltinAttributes& builtin) {
  const std::int64_t usual = stays_here ? 250 : 1000;
  builtin.discovery_config.leaseDuration = duration(options.lease.count());
  builtin.discovery_config.leaseDuration_announcementperiod =
      duration(std::min<std::int64_t>(options.lease.count() / 3, usual));
}

}  // namespace

void ReceiveGate::open() {
  const std::lock_guard lock(mutex_);
  is_open_ = true;
  opened_.notify_all();
}

bool ReceiveGate::admits(std::span<const std::uint8_t> datagram) {
  std::unique_lock lock(mutex_);
  if (!guard_.admits(datagram)) return false;
  for (const Acknowledgement& acknowledgement : guard_.acknowledgements())
    acknowledgements_->receive(acknowledgement);
  opened_.wait_for(lock, std::chrono::seconds(1), [&] { return is_open_; });
  is_open_ = true;
  return true;
}

void ReceiveGate::receive(std::span<const std::uint8_t> datagram,
                          const std::function<void(std::span<const std::uint8_t>)>& deliver) {
  bool is_admitted = admits(datagram);
  if (is_admitted && has_announcement(datagram)) {
    // Ports have a thread each; an announcement is compared with those that were processed before.
    const std::lock_guard lock(announcements_mutex_);
    const auto reduced = discovery_.reduced(datagram);
    is_admitted = reduced.has_value();
    if (reduced) deliver(*reduced);
  } else if (is_admitted) {
    deliver(datagram);
  }
  if (!is_admitted) refused_.fetch_add(1, std::memory_order_relaxed);
}

dds::DomainParticipantQos participant_qos(const ParticipantOptions& options,
                                          std::shared_ptr<ReceiveGate> receive_gate) {
  dds::DomainParticipantQos qos;
  qos.name(options.enclave);
  set_user_data(qos.user_data(), "enclave=" + options.enclave + ";");

  auto& builtin = qos.wire_protocol().builtin;
  const bool off = options.range == DiscoveryRange::off;
  const bool stays = off || (options.range == DiscoveryRange::localhost && options.static_peers.empty());
  set_announcements(options, stays, builtin);
  // Otherwise a peer that announces thousands of nonexistent participants would make Fast DDS send to
  // all of them.
  qos.allocation().participants.maximum = kMaxParticipants;
  qos.allocation().readers.maximum = kMaxEndpoints / kMaxParticipants;  // of all: the product of the two
  qos.allocation().writers.maximum = kMaxEndpoints / kMaxParticipants;
  // Discovery messages of a participant with many endpoints are longer than the default allocation.
  builtin.readerHistoryMemoryPolicy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  builtin.writerHistoryMemoryPolicy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;

  const Reach reach = off ? Reach::nobody : stays ? Reach::this_machine : Reach::all;
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(guarded_transport(reach, std::move(receive_gate)));

  const std::string own_address = stays ? kLoopback : "0.0.0.0";
  const Ports ports = free_ports(options.domain, own_address);
  builtin.metatrafficUnicastLocatorList.push_back(locator(own_address, ports.discovery));
  qos.wire_protocol().default_unicast_locator_list.push_back(locator(own_address, ports.data));

  if (off) return qos;
  // Also in a subnet, because programs that are limited to this machine do not receive its multicast.
  builtin.initialPeersList.push_back(locator(kLoopback, 0));
  for (const std::string& address : options.static_peers)
    builtin.initialPeersList.push_back(locator(address, 0));  // port 0: those of the first participants
  if (options.range == DiscoveryRange::localhost) return qos;
  const rtps::Locator_t group = locator("239.255.0.1", ports.multicast);
  builtin.metatrafficMulticastLocatorList.push_back(group);
  builtin.initialPeersList.push_back(group);
  return qos;
}

}  // namespace doppel::ros2::fast
