#pragma once
// One probe for each subject.

#include "doppel/review/doctor/machine.h"

namespace doppel::doctor {

ProgramFacts probe_program(const ProgramPlace& program);
ProcessorFacts probe_processor();
DisplayFacts probe_display();
NetworkFacts probe_network();
StorageFacts probe_storage(const ProgramPlace& program);
SerialFacts probe_serial();

// Sends a datagram to ROS 2's discovery group on the interface of `address`, and waits for it to come back.
// It does not leave the machine. Empty: it came back; else why not.
std::string probe_multicast(const std::string& address, unsigned domain);

// The first line of a file without its end; empty where it cannot be read.
std::string first_line(const std::filesystem::path& file);

}  // namespace doppel::doctor
