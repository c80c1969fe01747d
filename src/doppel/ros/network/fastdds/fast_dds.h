#pragma once
// Fast DDS 2 (Debian 12) or Fast DDS 3 (Debian 13) under the same names. Both headers define
//
//   rtps, transport                  the namespaces of RTPS and of transports
//   kVersion                         of the library, as text
//   DdsDuration, kForever            durations, and the infinite one
//   is_ok(), turn_off_intraprocess() return codes; delivery through the network also within a process
//   ParticipantData, ReaderData, WriterData, and guid_of() to unicast_of()   the results of discovery
//   DiscoveryListener                its callbacks, with one form
//   TypeOfBytes                      a type whose samples are bytes
//   Datagram, TransportOfDatagrams   a transport that sees each datagram before it is sent
//
// and the few settings that have other names. Everything else in this folder is written once.

#if __has_include(<fastdds/rtps/common/Guid.hpp>)
#include "doppel/ros/network/fastdds/fast_dds_3.h"
#else
#include "doppel/ros/network/fastdds/fast_dds_2.h"
#endif
