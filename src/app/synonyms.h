#pragma once
// Words that users of other tools type by habit, and what they are in doppel.

#include <string>
#include <string_view>

namespace doppel::app {

// The verb to type instead of the verb `word` of `group` ("" for the program itself); "": the word has no
// entry.
std::string pointer_for(std::string_view group, std::string_view word);

// The type to use in ROS 2 instead of a type of ROS 1, as a sentence; "": the type is not known to have been
// one.
std::string replacement_of_ros1_type(std::string_view type);

}  // namespace doppel::app
