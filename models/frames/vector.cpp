#include <orrery/models/frames/vector.hpp>

namespace orrery {

// Shepperd, J. Guidance and Control 1(3) 1978: divide by the largest of the four components, so
// that no digits are lost near half a turn.
Quaternion to_quaternion(const Mat3& R) {
  const double xx = R.row_x.x, yy = R.row_y.y, zz = R.row_z.z;
  const double trace = xx + yy + zz;
  Quaternion q;
  if (trace >= xx && trace >= yy && trace >= zz) {
    q = {1 + trace, R.row_z.y - R.row_y.z, R.row_x.z - R.row_z.x, R.row_y.x - R.row_x.y};
  } else if (xx >= yy && xx >= zz) {
    q = {R.row_z.y - R.row_y.z, 1 + xx - yy - zz, R.row_x.y + R.row_y.x, R.row_z.x + R.row_x.z};
  } else if (yy >= zz) {
    q = {R.row_x.z - R.row_z.x, R.row_x.y + R.row_y.x, 1 + yy - xx - zz, R.row_y.z + R.row_z.y};
  } else {
    q = {R.row_y.x - R.row_x.y, R.row_z.x + R.row_x.z, R.row_y.z + R.row_z.y, 1 + zz - xx - yy};
  }
  const double length = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  const double s = (q.w < 0 ? -1 : 1) / length;
  return {s * q.w, s * q.x, s * q.y, s * q.z};
}

Mat3 to_matrix(const Quaternion& q) {
  const double w = q.w, x = q.x, y = q.y, z = q.z;
  return {{w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)},
          {2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)},
          {2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z}};
}

}  // namespace orrery
