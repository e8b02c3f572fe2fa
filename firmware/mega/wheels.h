// Left and right, and a value for each.
#pragma once

enum Side : unsigned char { LEFT, RIGHT };

template <typename T>
struct Both {
  T left, right;
};
