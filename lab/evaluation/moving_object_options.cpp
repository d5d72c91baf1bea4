#include "evaluation/moving_object_options.h"

#include "evaluation/picture_options.h"

namespace dtsdf {

void addObjectOptions(CommandLine& line, MovingObject& object) {
  line.add({"--shape", "NAME", "box or ball (default box)"},
           [&](const std::string& text) { object.shape = objectShapeFromName(text); });
  line.add({"--size", "X,Y,Z",
            "its sides or diameters along the axes of the map frame, in metres (default "
            "0.3,0.3,0.3)"},
           [&](const std::string& text) {
             object.size_m = readPoint(text);
             if (object.size_m.minCoeff() <= 0.0) throw UsageError("lengths must be above 0");
           });
  line.add({"--from", "X,Y,Z", "its centre at the start, in the map frame"},
           [&](const std::string& text) { object.from_W = readPoint(text); });
  line.add({"--to", "X,Y,Z", "its centre at the end; it moves there along a straight line"},
           [&](const std::string& text) { object.to_W = readPoint(text); });
  line.require("--from");
  line.require("--to");
}

}  // namespace dtsdf
