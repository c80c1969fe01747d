#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "doppel/review/doctor/detail/probes.h"
#include "doppel/review/doctor/findings.h"

namespace doppel::doctor {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

const Finding& find(const std::vector<Finding>& findings, std::string_view name) {
  static const Finding none;
  const auto at = std::ranges::find(findings, name, &Finding::name);
  EXPECT_NE(at, findings.end()) << name;
  return at == findings.end() ? none : *at;
}

InterfaceFacts loopback() {
  return {"lo", "127.0.0.1", true, true, false, ""};
}
InterfaceFacts ethernet() {
  return {"eth0", "192.168.1.2", false, true, true, ""};
}

// A machine without problems.
Machine good_machine() {
  Machine machine;
  machine.program = {"1.0", "/page", true, {{"mujoco", "libmujoco-dev", true, true, ""}}};
  machine.processor = {8, 8, 0.5, "6.1", "performance", true, "", 98, -1};
  machine.display = {true, false, true, false, true, {"firefox"}, {"/dev/dri/renderD128"}, {}};
  machine.network.interfaces = {loopback(), ethernet()};
  machine.network.range = "localhost";
  machine.storage.places = {
      {"temporary", "temporary files", "/tmp", true, true, std::int64_t{1} << 33, 100000}};
  machine.storage.file_watches = 65536;
  machine.storage.watch_instances = 512;
  machine.storage.open_files = 1024;
  return machine;
}

SerialFacts::Port usb_port(bool permits, std::optional<int> latency_timer = {}) {
  PortInfo info;
  info.path = "/dev/ttyUSB0";
  info.usb_id = "0403:6014";
  info.latency_timer = latency_timer;
  return {info, "dialout", permits};
}

TEST(Doctor, PortWithoutPermissionNamesItsGroup) {
  SerialFacts facts;
  facts.ports.push_back(usb_port(false));
  const Finding finding = judge_serial(facts).front();
  EXPECT_EQ(finding.level, Level::note);
  EXPECT_THAT(finding.remedy, HasSubstr("usermod -aG dialout"));
}

TEST(Doctor, SlowLatencyTimerIsFoundWithItsRate) {
  SerialFacts facts;
  facts.ports.push_back(usb_port(true, 16));
  EXPECT_THAT(judge_serial(facts).front().why, HasSubstr("about 62 cycles a second"));
  facts.ports.front() = usb_port(true, 1);
  EXPECT_EQ(judge_serial(facts).front().level, Level::ok);
}

TEST(Doctor, ModemManagerIsNamed) {
  SerialFacts facts;
  EXPECT_EQ(judge_serial(facts).size(), 1U);
  facts.has_modem_manager = true;
  EXPECT_THAT(judge_serial(facts).back().what, HasSubstr("ModemManager"));
}

TEST(Doctor, MachineWithEverythingHasOnlyOkFindings) {
  for (const Finding& finding : judge(good_machine())) {
    EXPECT_EQ(finding.level, Level::ok) << finding.name << ": " << finding.what;
    EXPECT_THAT(finding.why + finding.remedy, IsEmpty()) << finding.name;
  }
}

TEST(Doctor, FindingThatIsNotOkSaysWhyAndWhatToDo) {
  const Machine bare;  // without engines, network, display or storage
  for (const Finding& finding : judge(bare)) {
    if (finding.level == Level::ok) continue;
    EXPECT_THAT(finding.why, Not(IsEmpty())) << finding.name;
    EXPECT_THAT(finding.remedy, Not(IsEmpty())) << finding.name;
  }
  EXPECT_TRUE(has_problem(judge(bare)));
}

TEST(Doctor, NamesOfFindingsAreUnique) {
  std::vector<std::string> names;
  for (const Finding& finding : judge(good_machine())) names.push_back(finding.name);
  std::ranges::sort(names);
  EXPECT_EQ(std::ranges::adjacent_find(names), names.end());
}

TEST(DoctorProgram, DefaultEngineThatDoesNotLoadIsProblem) {
  ProgramFacts facts = good_machine().program;
  facts.engines = {{"mujoco", "libmujoco-dev", true, true, "libmujoco.so: not found"},
                   {"bullet", "libbullet-dev", false, true, ""}};
  const auto findings = judge_program(facts);
  EXPECT_EQ(find(findings, "engine.mujoco").level, Level::problem);
  EXPECT_THAT(find(findings, "engine.mujoco").what, HasSubstr("libmujoco.so: not found"));
  EXPECT_THAT(find(findings, "engine.mujoco").remedy, HasSubstr("apt install libmujoco-dev"));
  EXPECT_EQ(find(findings, "engine.bullet").level, Level::ok);
}

TEST(DoctorProgram, FurtherEngineThatIsMissingIsNote) {
  ProgramFacts facts = good_machine().program;
  facts.engines.push_back({"bullet", "libbullet-dev", false, false, ""});
  EXPECT_EQ(find(judge_program(facts), "engine.bullet").level, Level::note);
}

TEST(DoctorProgram, MissingPageIsNoteWithItsFolder) {
  ProgramFacts facts = good_machine().program;
  facts.page_is_built = false;
  EXPECT_EQ(find(judge_program(facts), "page").level, Level::note);
  EXPECT_THAT(find(judge_program(facts), "page").what, HasSubstr("/page"));
}

TEST(DoctorProcessor, OneUsableCoreIsNote) {
  ProcessorFacts facts = good_machine().processor;
  facts.usable_cores = 1;
  EXPECT_THAT(find(judge_processor(facts), "cores").what, HasSubstr("1 of 8 cores"));
  EXPECT_EQ(find(judge_processor(facts), "cores").level, Level::note);
}

TEST(DoctorProcessor, BusyMachineIsNote) {
  ProcessorFacts facts = good_machine().processor;
  facts.load = 20;
  EXPECT_THAT(find(judge_processor(facts), "cores").what, HasSubstr("20.0 processes"));
}

TEST(DoctorProcessor, RealTimeThatIsNotPermittedNamesLimit) {
  ProcessorFacts facts = good_machine().processor;
  facts.scheduling_failure = "Operation not permitted";
  facts.rtprio_limit = 0;
  facts.memlock_limit = std::int64_t{8} << 20;
  facts.has_preempt_rt = false;
  facts.governor = "powersave";
  const auto findings = judge_processor(facts);
  EXPECT_THAT(find(findings, "realtime.priority").what, HasSubstr("RLIMIT_RTPRIO is 0"));
  EXPECT_THAT(find(findings, "realtime.memory").what, HasSubstr("only 8 MiB"));
  for (const char* name : {"realtime.priority", "realtime.memory", "realtime.kernel", "governor"})
    EXPECT_EQ(find(findings, name).level, Level::note) << name;
}

TEST(DoctorDisplay, GpuOfAnotherGroupNamesGroup) {
  DisplayFacts facts = good_machine().display;
  std::swap(facts.render_nodes, facts.forbidden_render_nodes);
  EXPECT_EQ(find(judge_display(facts), "gpu").level, Level::note);
  EXPECT_THAT(find(judge_display(facts), "gpu").remedy, HasSubstr("render"));
}

TEST(DoctorDisplay, SshSessionSaysHowToForwardPort) {
  DisplayFacts facts = good_machine().display;
  facts.is_ssh = true;
  EXPECT_THAT(find(judge_display(facts), "browser").remedy, HasSubstr("ssh -L 8700"));
}

TEST(DoctorNetwork, RefusedVariableIsProblem) {
  NetworkFacts facts = good_machine().network;
  facts.environment_failure = "ROS_DOMAIN_ID is 'x'";
  EXPECT_EQ(find(judge_network(facts), "ros.environment").level, Level::problem);
}

TEST(DoctorNetwork, VariablesAreShownWithTheirMeaning) {
  NetworkFacts facts = good_machine().network;
  facts.environment = {{"ROS_DOMAIN_ID", "7"}};
  facts.domain = 7;
  EXPECT_THAT(find(judge_network(facts), "ros.environment").what,
              HasSubstr("ROS_DOMAIN_ID=7: domain 7, this machine only"));
}

TEST(DoctorNetwork, LoopbackThatIsDownIsProblem) {
  NetworkFacts facts = good_machine().network;
  facts.interfaces.front().is_up = false;
  EXPECT_EQ(find(judge_network(facts), "multicast.lo").level, Level::problem);
  facts.interfaces.erase(facts.interfaces.begin());
  EXPECT_EQ(find(judge_network(facts), "multicast.lo").level, Level::problem);
}

TEST(DoctorNetwork, InterfaceThatDropsMulticastIsNoteWithCause) {
  NetworkFacts facts = good_machine().network;
  facts.interfaces[1].multicast_failure = "nothing can be sent: Network is unreachable";
  const auto findings = judge_network(facts);
  EXPECT_EQ(find(findings, "multicast.eth0").level, Level::note);
  EXPECT_THAT(find(findings, "multicast.eth0").what, HasSubstr("Network is unreachable"));
}

TEST(DoctorNetwork, TakenPortNamesItsHolder) {
  NetworkFacts facts = good_machine().network;
  facts.taken_page_ports = {{8700, "the twin of omarm (process 12)"}};
  EXPECT_EQ(find(judge_network(facts), "ports.page").level, Level::note);
  EXPECT_THAT(find(judge_network(facts), "ports.page").what, HasSubstr("the twin of omarm"));
}

TEST(DoctorNetwork, NoFreePortIsProblem) {
  NetworkFacts facts = good_machine().network;
  for (int port = kFirstPagePort; port <= kLastPagePort; ++port)
    facts.taken_page_ports.push_back({port, "another program"});
  EXPECT_EQ(find(judge_network(facts), "ports.page").level, Level::problem);
}

TEST(DoctorStorage, FullDiskIsNoteWithWhatIsLeft) {
  StorageFacts facts = good_machine().storage;
  facts.places.front().free_bytes = std::int64_t{5} << 20;
  EXPECT_EQ(judge_storage(facts).front().level, Level::note);
  EXPECT_THAT(judge_storage(facts).front().what, HasSubstr("5 MiB left"));
}

TEST(DoctorStorage, MissingSharedMemoryIsNote) {
  StorageFacts facts = good_machine().storage;
  facts.places = {{"shared_memory", "shared memory", "/dev/shm", false, false, -1, -1}};
  EXPECT_THAT(judge_storage(facts).front().remedy, HasSubstr("mount -t tmpfs"));
}

TEST(DoctorStorage, FewFileWatchesAreNote) {
  StorageFacts facts = good_machine().storage;
  facts.file_watches = 100;
  EXPECT_EQ(find(judge_storage(facts), "watches").level, Level::note);
}

TEST(DoctorReport, TextEndsWithCounts) {
  const auto good = judge(good_machine());
  EXPECT_THAT(report_text(good, false), HasSubstr("no problems, no notes: nothing prevents `doppel up`"));
  EXPECT_THAT(report_text({{Level::problem, "a", "b", "c", "d", "e"}}, false),
              HasSubstr("1 problem, no notes\n"));
  EXPECT_THAT(report_text(good, true), HasSubstr("\033[32m"));
}

TEST(DoctorReport, JsonSurvivesBytesThatAreNotText) {
  Machine machine = good_machine();
  machine.network.environment = {{"ROS_X", "\xff"}};
  EXPECT_THAT(report_json(machine, judge(machine)), HasSubstr("\"ready\": true"));
}

TEST(DoctorProbe, FactsOfThisMachineAreGathered) {
  const Machine machine = gather_facts({"1.0", "/nowhere", "/nowhere/page"});
  EXPECT_GE(machine.processor.cores, machine.processor.usable_cores);
  EXPECT_GE(machine.processor.usable_cores, 1);
  EXPECT_FALSE(machine.program.page_is_built);
  EXPECT_FALSE(machine.program.engines.empty());
  EXPECT_FALSE(machine.storage.places.empty());
}

TEST(DoctorProbe, MulticastOnAddressOfNobodyFails) {
  EXPECT_THAT(probe_multicast("203.0.113.1", 0), Not(IsEmpty()));
}

}  // namespace
}  // namespace doppel::doctor
