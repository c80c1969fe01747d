// The edge's end of the bus. Its requests are decoded here, on its own thread, and executed by the loop.

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>

#include "doppel/base/core/names.h"
#include "doppel/base/core/thrown.h"
#include "doppel/ros/bus/detail/bus_impl.h"
#include "doppel/ros/bus/parameter_services.h"
#include "doppel/ros/bus/twist_conversion.h"

namespace doppel {
namespace {

using bus_detail::EdgeLink;
using bus_detail::RecordHeader;

// Waking an edge costs the loop a system call of some microseconds. While messages are frequent, a waiting
// edge polls after short sleeps instead, at no cost for the loop.
constexpr std::chrono::microseconds kPollInterval{150};
constexpr int kMaxEmptyPolls = 12;  // without a message, before the edge waits to be woken

// The existence of an edge, which its replies share. Locked while a reply runs, so that the edge's destructor waits for its end.
struct Liveness {
  std::recursive_mutex mutex;  // recursive: a reply may destroy its own edge
  bool alive = true;

  template <class Call>
  void if_alive(Call call) {
    const std::lock_guard lock(mutex);
    if (alive) call();
  }
};

using Reply = std::function<void(Status, Bytes)>;

class EdgeReply : public bus_detail::PendingReply {
 public:
  EdgeReply(std::shared_ptr<Liveness> edge, std::string service, Reply reply)
      : edge_(std::move(edge)), service_(std::move(service)), reply_(std::move(reply)) {}
  ~EdgeReply() override {
    answer(Status::refused(fmt::format("service {} was removed before it answered", service_)), {});
  }

  void answer(Status status, Bytes response) override {
    if (answered_) return;
    answered_ = true;
    edge_->if_alive([&] { reply_(std::move(status), std::move(response)); });
  }

 private:
  std::shared_ptr<Liveness> edge_;
  std::string service_;
  Reply reply_;
  bool answered_ = false;
};

void handle(const bus_detail::ServiceEntry& entry, const void* request,
            const std::shared_ptr<bus_detail::PendingReply>& reply) {
  try {
    entry.handle(request, reply);
  } catch (...) {
    reply->answer(Status::refused(fmt::format("service {} failed: {}", entry.name, thrown_text())), {});
  }
}

class EdgeImpl : public Edge {
 public:
  EdgeImpl(Bus& bus, Bus::Impl& impl, std::string name, const EdgeOptions& options)
      : bus_(bus),
        impl_(impl),
        link_(std::make_shared<EdgeLink>(bus, std::move(name), options)),
        own_lane_(make_lane_of(link_)),
        lane_(own_lane_) {}

  ~EdgeImpl() override {
    {
      const std::lock_guard lock(liveness_->mutex);
      liveness_->alive = false;
    }
    // The task keeps the link, so that its ring is freed by a thread that posts and not by the loop.
    lane_ = own_lane_;
    post_bytes(0, [&impl = impl_, link = link_] {
      link->set_removed();
      impl.remove_owner(link.get());
    });
  }

  [[nodiscard]] std::shared_ptr<Inbox::Lane> make_lane() override { return make_lane_of(link_); }
  void act_for(std::shared_ptr<Inbox::Lane> lane) override {
    lane_ = lane != nullptr ? std::move(lane) : own_lane_;
  }
  void wake_when_served(bool on) override { link_->wake_when_served(on); }
  void post(std::function<void()> task) override { post_bytes(0, std::move(task)); }

  void subscribe(TopicId topic) override {
    link_->set_wanted(topic, true);
    post([&impl = impl_, link = link_, topic] { impl.subscribe_link(topic, link); });
  }
  void unsubscribe(TopicId topic) override {
    link_->set_wanted(topic, false);
    post([&impl = impl_, link = link_, topic] { impl.unsubscribe_link(topic, link); });
  }

  bool next(Incoming& message) override {
    release();
    auto record = link_->ring().front();
    if (record.data() == nullptr && fd_is_watched_) {
      link_->drain();
      record = link_->front_or_arm();
    }
    taken_ = record.data() != nullptr;
    if (!taken_) return false;
    empty_polls_ = 0;
    const RecordHeader header = bus_detail::header_of(record);
    message = {header.topic, time_from_nanoseconds(header.stamp), record.subspan(sizeof(header)),
               header.sequence, header.latched};
    if (header.shared != 0) {
      shared_ = link_->take(record);
      message.cdr = *shared_;
      // Popped at once: its record must not be found by the destructor of the ring's owner.
      link_->ring().pop();
      taken_ = false;
    }
    return true;
  }

  void wait(std::chrono::milliseconds at_most) override {
    release();
    const auto end = std::chrono::steady_clock::now() + at_most;
    while (link_->ring().front().data() == nullptr && empty_polls_ < kMaxEmptyPolls) {
      if (end - std::chrono::steady_clock::now() < kPollInterval) break;
      ++empty_polls_;
      if (is_woken_within(kPollInterval)) return;
    }
    if (link_->front_or_arm().data() == nullptr) is_woken_within(end - std::chrono::steady_clock::now());
  }

  void wake() override { link_->signal(); }
  [[nodiscard]] int readable_fd() const override {
    fd_is_watched_ = true;
    return link_->fd();
  }
  [[nodiscard]] std::uint64_t dropped() const override { return link_->ring().dropped(); }
  [[nodiscard]] std::size_t waiting_bytes() const override { return link_->waiting_bytes(); }

  Status publish(std::string_view from, std::string_view topic, std::string_view type,
                 std::span<const std::byte> cdr) override;
  Status advertise(std::string_view node, std::string_view topic, std::string_view type,
                   const Qos& qos) override;
  void unadvertise(std::string_view from, std::string_view topic) override;
  void call_from(const CallOrigin& origin, std::string_view service, std::span<const std::byte> request_cdr,
                 Reply reply) override;
  void get_parameters(std::function<void(const SharedParameters&)> reply) override;
  void get_parameters(std::vector<std::pair<std::string, std::string>> nodes_and_names,
                      std::function<void(const SharedParameters&)> reply) override;
  void set_parameter(std::string_view node, std::string_view name, const ParameterValue& value,
                     std::function<void(Status)> reply) override;

 private:
  Status target_of(const std::string& topic, std::string_view type, const TypeSupport*& support,
                   const bus_detail::TopicOps*& ops, bool& converts) const;
  Status publish_twist(std::string_view from, const std::string& topic, std::string_view type,
                       const TypeSupport& read, std::span<const std::byte> cdr);
  // The objects of a call; weak, so that handlers are only destroyed by the loop.
  struct Target {
    std::weak_ptr<const bus_detail::ServiceEntry> entry;
    decltype(bus_detail::ServiceEntry::decode) decode = nullptr;  // nullptr: no such service
  };
  Target find_target(std::string_view name, std::string& why) const;

  // Ends the use of the message taken last.
  void release() {
    if (taken_) link_->ring().pop();
    taken_ = false;
    shared_.reset();
  }
  bool is_woken_within(std::chrono::nanoseconds time) {
    const timespec at_most{
        .tv_sec = std::max<time_t>(0, time / std::chrono::seconds(1)),
        .tv_nsec = std::max<long>(0, time % std::chrono::seconds(1) / std::chrono::nanoseconds(1))};
    pollfd poll_fd{link_->fd(), POLLIN, 0};
    if (ppoll(&poll_fd, 1, &at_most, nullptr) <= 0) return false;
    link_->drain();
    return true;
  }

  static std::shared_ptr<Inbox::Lane> make_lane_of(const std::shared_ptr<EdgeLink>& link) {
    return std::make_shared<Inbox::Lane>([link] { link->served(); });
  }
  void post_bytes(std::size_t bytes, std::function<void()> task) {
    impl_.inbox().post(lane_, std::move(task), bytes);
  }

  Bus& bus_;
  Bus::Impl& impl_;
  std::shared_ptr<EdgeLink> link_;
  std::shared_ptr<Inbox::Lane> own_lane_, lane_;  // lane_: of the following requests
  std::shared_ptr<Liveness> liveness_ = std::make_shared<Liveness>();
  bus_detail::SharedCdr shared_;  // the message that next() returned, if it was encoded already
  bool taken_ = false;            // the record at the ring's front was returned by next()
  int empty_polls_ = kMaxEmptyPolls;
  mutable bool fd_is_watched_ = false;
};

// The type of a message's bytes, or the reason why the topic cannot accept them. `converts`: the topic has another
// type, which is in `support`.
Status EdgeImpl::target_of(const std::string& topic, std::string_view type, const TypeSupport*& support,
                           const bus_detail::TopicOps*& ops, bool& converts) const {
  support = find_type(type);
  if (support == nullptr) {
    return Status::refused(
        fmt::format("unknown message type '{}'{}", type, did_you_mean(type, type_names())));
  }
  const std::lock_guard lock(impl_.mutex);
  const auto found = impl_.by_name.find(topic);
  if (found == impl_.by_name.end()) return {};
  const bus_detail::Topic& existing = *found->second;
  if (existing.support->name == support->name) {
    ops = existing.ops;
    return {};
  }
  if (existing.publishers.empty() && existing.subscribers.empty()) return {};
  const bool is_read = std::ranges::any_of(existing.subscribers, &bus_detail::Endpoint::is_node);
  if (is_read && bus_.twists() != TwistPolicy::refuse &&
      is_convertible_twist(support->name, existing.support->name)) {
    converts = true;
    support = existing.support;
    return {};
  }
  return Status::refused(
      fmt::format("topic {} has type {}, not {}", topic, existing.support->name, support->name));
}

Status EdgeImpl::publish(std::string_view from, std::string_view topic, std::string_view type,
                         std::span<const std::byte> cdr) {
  const std::string name = topic.starts_with('/') ? std::string(topic) : fmt::format("/{}", topic);
  if (Status fine = check_topic_name(name); !fine) return fine;
  const TypeSupport* support = nullptr;
  const bus_detail::TopicOps* ops = nullptr;
  bool converts = false;
  Status status = target_of(name, type, support, ops, converts);
  if (!status) return status;
  if (converts) return publish_twist(from, name, type, *support, cdr);
  std::shared_ptr<const void> message;
  const auto input = std::make_shared<BusInput>(BusInput{BusInput::Kind::message, std::string(from), name,
                                                         support->name, Bytes(cdr.begin(), cdr.end())});
  // A topic with a node in this program gets the decoded message; one that only other edges read gets
  // bytes, which are checked all the same, because a reader must be able to trust them.
  status = ops != nullptr ? ops->decode(cdr, message) : support->recode(cdr, input->data);
  if (!status) return status;
  post_bytes(cdr.size(), [&impl = impl_, link = link_, support, message = std::move(message),
                          input = std::shared_ptr<const BusInput>(input)] {
    if (link->is_removed()) return;
    const auto target = impl.topic_for_edge(input->target, *support);
    if (target == nullptr) return;  // a node has used the name with another type since
    if (target->ops != nullptr) impl.bus.report_input(*input);
    impl.add_endpoint(*target, true, {link.get(), {input->source, link->name(), {}}});
    impl.keep(*target, link.get(), input->source, input->data);
    impl.receive(*target, input->data, message, link.get());
  });
  return {};
}

Status EdgeImpl::publish_twist(std::string_view from, const std::string& topic, std::string_view type,
                               const TypeSupport& read, std::span<const std::byte> cdr) {
  const bool refused = bus_.twists() == TwistPolicy::explain;
  Bytes checked;
  if (Status valid = convert_twist(type, cdr, {}, checked); !valid) return valid;
  BusInput input{BusInput::Kind::message, std::string(from), topic, std::string(type),
                 Bytes(cdr.begin(), cdr.end())};
  post_bytes(
      cdr.size(), [&bus = bus_, &impl = impl_, link = link_, &read, refused, input = std::move(input)] {
        if (link->is_removed()) return;
        if (!link->reports_conversions()) impl.explain_twist(input.source, input.target, input.type);
        const auto target = refused ? nullptr : impl.topic_for_edge(input.target, read);
        if (target == nullptr) return;
        impl.bus.report_input(input);
        Bytes converted;
        static_cast<void>(
            convert_twist(input.type, input.data, to_time_msg(bus.ros_now()), converted));  // checked before
        impl.add_endpoint(*target, true, {link.get(), {input.source, link->name(), {}}});
        impl.keep(*target, link.get(), input.source, converted);
        impl.receive(*target, converted, nullptr, link.get());
      });
  return refused ? Status::refused(twist_conversion_text(from, topic, type, true)) : Status{};
}

Status EdgeImpl::advertise(std::string_view node, std::string_view topic, std::string_view type,
                           const Qos& qos) {
  if (Status fine = check_topic_name(topic); !fine) return fine;
  const TypeSupport* support = nullptr;
  const bus_detail::TopicOps* ops = nullptr;
  bool converts = false;
  if (Status status = target_of(std::string(topic), type, support, ops, converts); !status || converts)
    return status;
  post([&impl = impl_, link = link_, node = std::string(node), topic = std::string(topic), support, qos] {
    if (link->is_removed()) return;
    const auto target = impl.topic_for_edge(topic, *support);
    if (target != nullptr) impl.advertise(*target, {link.get(), {node, link->name(), qos}});
  });
  return {};
}

void EdgeImpl::unadvertise(std::string_view from, std::string_view topic) {
  post([&impl = impl_, link = link_, from = std::string(from), topic = std::string(topic)] {
    impl.remove_publisher(topic, link.get(), from);
  });
}

EdgeImpl::Target EdgeImpl::find_target(std::string_view name, std::string& why) const {
  const std::lock_guard lock(impl_.mutex);
  // While a reload is staged, requests go to the services of before, because the new ones may be rolled
  // back.
  const Bus::Impl::GraphReport* const before = impl_.graph_before_stage();
  const auto& services = before != nullptr ? before->entries : impl_.services;
  const auto found = services.find(name);
  if (found != services.end()) return {found->second, found->second->decode};
  std::vector<std::string> names;
  for (const auto& [known, entry] : services) names.push_back(known);
  why = fmt::format("there is no service {}{}", name, did_you_mean(name, names));
  return {};
}

void EdgeImpl::call_from(const CallOrigin& origin, std::string_view service,
                         std::span<const std::byte> request_cdr, Reply reply) {
  std::string why;
  std::shared_ptr<const void> request;
  const Target target = find_target(service, why);
  if (target.decode != nullptr) {
    if (const Status status = target.decode(request_cdr, request); !status) {
      why = fmt::format("request for {} rejected: {}", service, status.why());
    }
  }
  auto pending = std::make_shared<EdgeReply>(liveness_, std::string(service), std::move(reply));
  BusInput input{BusInput::Kind::call, "", std::string(service), "",
                 Bytes(request_cdr.begin(), request_cdr.end())};
  post_bytes(request_cdr.size(), [&impl = impl_, why, target, request = std::move(request),
                                  pending = std::move(pending), origin, input = std::move(input)]() mutable {
    const auto reply_to = std::move(pending);  // moved out of the task, which is destroyed on another thread
    if (!why.empty()) {
      reply_to->answer(Status::refused(why), {});
    } else if (const auto found = impl.serving(input.target, target.entry, target.decode)) {
      impl.bus.report_input(input);
      handle(*found, request.get(), impl.with_events(found, origin, input.data, reply_to));
    }
  });
}

void EdgeImpl::get_parameters(std::function<void(const SharedParameters&)> reply) {
  post([&impl = impl_, edge = liveness_, reply = std::move(reply)] {
    edge->if_alive([&] { reply(impl.all_parameters()); });
  });
}

void EdgeImpl::get_parameters(std::vector<std::pair<std::string, std::string>> nodes_and_names,
                              std::function<void(const SharedParameters&)> reply) {
  post([&impl = impl_, edge = liveness_, requested = std::move(nodes_and_names), reply = std::move(reply)] {
    const auto found = std::make_shared<std::vector<NamedParameter>>();
    for (const auto& [node, name] : requested) {
      Node* const owner = impl.find_node(node, name);
      const auto* const declared = owner != nullptr ? owner->parameters().find(name) : nullptr;
      if (declared != nullptr) found->push_back({node, name, declared->value});
    }
    edge->if_alive([&] { reply(found); });
  });
}

void EdgeImpl::set_parameter(std::string_view node, std::string_view name, const ParameterValue& value,
                             std::function<void(Status)> reply) {
  BusInput input{BusInput::Kind::parameter, "", std::string(node), std::string(name), to_cdr(to_msg(value))};
  post([&impl = impl_, &bus = bus_, edge = liveness_, input = std::move(input), value,
        reply = std::move(reply)] {
    Node* target = impl.find_node(input.target, input.type);
    if (target != nullptr) impl.bus.report_input(input);
    Status status = target != nullptr ? target->parameters().set(input.type, value)
                                      : Status::refused(fmt::format("there is no node {}{}", input.target,
                                                                    did_you_mean(input.target, bus.nodes())));
    edge->if_alive([&] { reply(std::move(status)); });
  });
}

}  // namespace

std::unique_ptr<Edge> make_edge(Bus& bus, Bus::Impl& impl, std::string name, const EdgeOptions& options) {
  return std::make_unique<EdgeImpl>(bus, impl, std::move(name), options);
}

}  // namespace doppel
