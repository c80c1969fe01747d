#include "doppel/ros/network/participant.h"

#include <algorithm>

#include "network.h"

namespace doppel::ros2::test {
namespace {

class ParticipantPairTest : public testing::Test {
 protected:
  OwnDomain domain_;
  Activity activity_;
  std::unique_ptr<Participant> here_ = make_participant(on_domain(domain_), activity_.signal());
  std::unique_ptr<Participant> there_ = make_participant(on_domain(domain_), activity_.signal());

  // Waits for the match as well.
  struct Pair {
    std::unique_ptr<Writer> writer;
    std::unique_ptr<Reader> reader;
  };
  Pair connect(const EndpointSpec& spec) {
    Pair pair{here_->make_writer(spec), there_->make_reader(spec)};
    EXPECT_TRUE(activity_.wait([&] { return pair.writer->matched() == 1 && pair.reader->matched() == 1; }));
    return pair;
  }
};

TEST_F(ParticipantPairTest, SampleCarriesIdentity) {
  const Pair pair = connect(text_topic());
  const SampleIdentity related{there_->gid(), 77};
  const auto sent = pair.writer->write(cdr_text("hello"), &related);
  ASSERT_TRUE(sent);
  EXPECT_EQ(sent->writer, pair.writer->gid());
  EXPECT_EQ(sent->sequence, 1);

  Sample sample;
  ASSERT_TRUE(activity_.wait([&] { return pair.reader->take(sample); }));
  EXPECT_EQ(sample.cdr, cdr_text("hello"));
  EXPECT_EQ(sample.identity, *sent);
  EXPECT_EQ(sample.related, related);
  EXPECT_GT(sample.source_timestamp, 0);
  EXPECT_GE(sample.reception_timestamp, sample.source_timestamp);
  EXPECT_TRUE(pair.writer->is_matched(pair.reader->gid()));
  EXPECT_TRUE(pair.reader->is_matched(pair.writer->gid()));
  EXPECT_FALSE(pair.reader->take(sample));
  EXPECT_FALSE(pair.reader->is_ready());
}

TEST_F(ParticipantPairTest, ReadyListsReceived) {
  const Pair pair = connect(text_topic());
  Sample sample;
  EXPECT_FALSE(pair.reader->take(sample));
  EXPECT_FALSE(pair.reader->is_ready());
  pair.writer->write(cdr_text("x"));
  EXPECT_TRUE(activity_.wait([&] { return pair.reader->is_ready(); }));
  EXPECT_TRUE(pair.reader->take(sample));
}

TEST_F(ParticipantPairTest, OwnSamplesAreNotReceived) {
  const Pair pair = connect(text_topic());
  const auto own = here_->make_reader(text_topic());
  pair.writer->write(cdr_text("for others"));
  Sample sample;
  ASSERT_TRUE(activity_.wait([&] { return pair.reader->take(sample); }));
  EXPECT_FALSE(own->take(sample));
  EXPECT_EQ(own->matched(), 0u);
  EXPECT_EQ(pair.writer->matched(), 1u);
}

TEST_F(ParticipantPairTest, LateReaderReceivesLatched) {
  const EndpointSpec spec = text_topic(latched_qos(2));
  const auto writer = here_->make_writer(spec);
  for (const char* text : {"one", "two", "three"}) writer->write(cdr_text(text));
  const auto reader = there_->make_reader(spec);
  Sample sample;
  ASSERT_TRUE(activity_.wait([&] { return reader->take(sample); }));
  EXPECT_EQ(sample.cdr, cdr_text("two"));
  ASSERT_TRUE(activity_.wait([&] { return reader->take(sample); }));
  EXPECT_EQ(sample.cdr, cdr_text("three"));
}

TEST_F(ParticipantPairTest, LargeSampleIsFragmented) {
  const Pair pair = connect(text_topic());
  const Bytes big = cdr_text(std::string(2'000'000, 'b'));
  Sample sample;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(pair.writer->write(big));
    ASSERT_TRUE(activity_.wait([&] { return pair.reader->take(sample); }));
    EXPECT_EQ(sample.cdr, big);
  }
}

// If each write blocked for the reader as long as DDS permits, they would take half an hour.
TEST_F(ParticipantPairTest, KeepAllWriterDoesNotBlock) {
  const Pair pair = connect(text_topic({.history = History::keep_all}));
  const Bytes text = cdr_text("x");
  std::size_t sent = 0;
  for (int i = 0; i < 30'000; ++i) sent += pair.writer->write(text).has_value() ? 1 : 0;
  EXPECT_LT(sent, 30'000u);
  std::size_t come = 0;
  Sample sample;
  EXPECT_TRUE(activity_.wait([&] {
    while (pair.reader->take(sample)) ++come;
    return come == sent;
  })) << "expected all samples; received "
      << come << " of " << sent;
  EXPECT_TRUE(activity_.wait([&] { return pair.writer->write(text).has_value(); }));
}

TEST_F(ParticipantPairTest, EndpointsOfBothSidesAreKnown) {
  const Pair pair = connect(text_topic(sensor_data_qos()));
  const auto find = [](const Participant& participant, const Gid& gid) {
    EndpointInfo found;
    for (const EndpointInfo& e : participant.endpoints())
      if (e.gid == gid) found = e;
    return found;
  };
  EndpointInfo remote;
  ASSERT_TRUE(activity_.wait([&] { return (remote = find(*there_, pair.writer->gid())).is_writer; }));
  EXPECT_EQ(remote.topic, "rt/text");
  EXPECT_EQ(remote.type, "std_msgs::msg::dds_::String_");
  EXPECT_EQ(remote.type_hash, "RIHS01_" + std::string(64, 'a'));
  EXPECT_EQ(remote.qos.reliability, Reliability::best_effort);
  EXPECT_EQ(remote.qos.deadline, QosProfile::kInfinite);
  EXPECT_EQ(remote.qos.history, History::unknown);
  EXPECT_FALSE(remote.is_own);

  const EndpointInfo own = find(*here_, pair.writer->gid());
  EXPECT_TRUE(own.is_own);
  EXPECT_EQ(own.qos.depth, 5u);
}

TEST_F(ParticipantPairTest, DepartedParticipantIsRemoved) {
  const Gid gone = there_->gid();
  const auto knows = [&] {
    const auto all = here_->participants();
    return std::any_of(all.begin(), all.end(), [&](const ParticipantInfo& p) { return p.gid == gone; });
  };
  {
    const Pair pair = connect(text_topic());
    EXPECT_TRUE(knows());
    EXPECT_EQ(here_->participants().back().enclave, "/");
  }
  auto reader = there_->make_reader(text_topic());
  const auto endpoints = [&] { return here_->endpoints().size(); };
  ASSERT_TRUE(activity_.wait([&] { return endpoints() == 1; }));
  const auto version = here_->discovery_version();
  reader.reset();
  there_.reset();
  EXPECT_TRUE(activity_.wait([&] { return !knows(); }));
  EXPECT_EQ(endpoints(), 0u);
  EXPECT_GT(here_->discovery_version(), version);
}

TEST_F(ParticipantPairTest, SecondTypeOfTopicIsRefused) {
  const auto writer = here_->make_writer(text_topic());
  EndpointSpec other = text_topic();
  other.type = "std_msgs::msg::dds_::Bool_";
  EXPECT_THROW((void)here_->make_reader(other), NetworkError);
}

TEST_F(ParticipantPairTest, DomainsAreIsolated) {
  const OwnDomain other;
  const auto elsewhere = make_participant(on_domain(other), activity_.signal());
  const auto stranger = elsewhere->make_reader(text_topic());
  const Pair pair = connect(text_topic());
  EXPECT_EQ(pair.writer->matched(), 1u);
  EXPECT_EQ(elsewhere->participants().size(), 1u);
}

}  // namespace
}  // namespace doppel::ros2::test
