#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>

#include "doppel/ros/network/detail/rtps_guard.h"
#include "doppel/ros/network/fastdds/fast_convert.h"
#include "doppel/ros/network/fastdds/fast_endpoint.h"
#include "doppel/ros/network/fastdds/fast_participant.h"

namespace doppel::ros2::fast {
namespace {

// A keep-all writer waits for readers that do not acknowledge, but not again within this time, because it
// would delay everything else that its thread writes.
constexpr std::chrono::milliseconds kFullRetryDelay{100};

class FastWriter : public Writer, dds::DataWriterListener {
 public:
  FastWriter(FastParticipant& participant, const EndpointSpec& spec)
      : participant_(participant),
        matches_(participant.gid()),
        topic_(participant.acquire_topic(spec)),
        keeps_all_(spec.qos.history == History::keep_all),
        of_service_(spec.of_service),
        drops_acknowledged_(spec.qos.durability == Durability::volatile_ &&
                            spec.qos.reliability == Reliability::reliable) {
    writer_ = participant_.publisher().create_datawriter(topic_, writer_qos(spec), this,
                                                         dds::StatusMask::publication_matched());
    if (writer_ == nullptr) {
      participant_.release_topic(topic_);
      throw NetworkError("Fast DDS cannot create a writer of '" + spec.topic + "'; check its QoS");
    }
    gid_ = gid_of(writer_->guid());
    participant_.announce(gid_, true, spec);
  }
  ~FastWriter() override {
    participant_.withdraw(gid_);
    writer_->set_listener(nullptr);
    participant_.publisher().delete_datawriter(writer_);
    participant_.acknowledgements().forget(gid_);
    participant_.release_topic(topic_);
  }
  FastWriter(const FastWriter&) = delete;
  FastWriter& operator=(const FastWriter&) = delete;

  [[nodiscard]] const Gid& gid() const override { return gid_; }

  std::optional<SampleIdentity> write(std::span<const std::byte> cdr,
                                      const SampleIdentity* related) override {
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    if (cdr.size() > kMaxSampleBytes || now < full_until_.load()) return std::nullopt;
    rtps::WriteParams params;
    if (related != nullptr) params.related_sample_identity(identity_of(*related));
    if (drops_acknowledged_) drop_strays();
    const bool is_answer = related != nullptr && of_service_;
    const AddressingScope addressee(gid_,
                                    is_answer ? participant_.reply_readers().of(related->writer) : Places());
    if (!fast::write(*writer_, &cdr, params)) {
      if (keeps_all_) full_until_ = now + kFullRetryDelay;
      return std::nullopt;
    }
    return SampleIdentity{gid_,
                          static_cast<std::int64_t>(params.sample_identity().sequence_number().to64long())};
  }

  std::size_t forget() override {
    std::size_t dropped = 0;
    writer_->clear_history(&dropped);
    return dropped;
  }

  [[nodiscard]] std::size_t matched() const override { return matches_.count(); }
  [[nodiscard]] bool is_matched(const Gid& reader) const override { return matches_.contains(reader); }
  [[nodiscard]] bool is_in_step(const Gid& reader) const override {
    return matches_.contains(reader) && !participant_.acknowledgements().is_awaited(gid_, reader);
  }

 private:
  // Fast DDS (2.9, also 2.14) never removes a volatile sample that was in the history when a reader was
  // matched, and lists the numbers of all later samples in each heartbeat, as a GAP of which readers process
  // every number: after 10,000 responses a client needs 10 ms for each of fifty heartbeats a second. The
  // samples are dropped only while all of them are acknowledged, which stays so until the next sample.
  void drop_strays() {
    if (is_ok(writer_->wait_for_acknowledgments({0, 0}))) forget();
  }

  void on_publication_matched(dds::DataWriter* writer, const dds::PublicationMatchedStatus& status) override {
    if (of_service_) {
      const Gid own = gid_of(writer->guid());
      const Gid reader = gid_of(rtps::iHandle2GUID(status.last_subscription_handle));
      auto& acknowledgements = participant_.acknowledgements();
      status.current_count_change > 0 ? acknowledgements.await(own, reader)
                                      : acknowledgements.forget(own, reader);
    }
    matches_.update(status.last_subscription_handle, status.current_count_change);
    participant_.on_activity();
  }

  FastParticipant& participant_;
  Matches matches_;
  dds::Topic* const topic_;
  const bool keeps_all_, of_service_, drops_acknowledged_;
  std::atomic<std::chrono::nanoseconds> full_until_{};
  dds::DataWriter* writer_ = nullptr;
  Gid gid_;
};

}  // namespace

std::unique_ptr<Writer> make_fast_writer(FastParticipant& participant, const EndpointSpec& spec) {
  return std::make_unique<FastWriter>(participant, spec);
}

}  // namespace doppel::ros2::fast
