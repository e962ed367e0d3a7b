// What the options of the schema say, in words: for faults and for the parameter reference.
#pragma once

#include <google/protobuf/descriptor.h>

#include <string>

#include "bedflow/v1/options.pb.h"

namespace bedflow {

const v1::Parameter& parameter_of(const google::protobuf::FieldDescriptor& field);
const v1::Choice& choice_of(const google::protobuf::OneofDescriptor& choice);

std::string number_text(double value);                             // shortest digits that give the same number
std::string quantity_text(double value, const std::string& unit);  // "0.002 m"; unit "1" is not written
std::string allowed_text(const v1::Parameter& parameter);          // "above 0 and at most 1 m"; empty without bounds

std::string child_path(const std::string& path, const std::string& name);  // "gas" + "density" -> "gas.density"
std::string item_path(const std::string& path, int index);                 // "monitors" + 2 -> "monitors[2]"

}  // namespace bedflow
