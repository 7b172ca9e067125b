#include "gradpsi/matrix.hpp"

#if EIGEN_MAJOR_VERSION > 4 || EIGEN_MINOR_VERSION >= 90
namespace gradpsi {

template <int alignment, bool by_malloc>
bool EigenAligns<alignment, by_malloc>::as_the_library_does() {
  return true;
}
template struct EigenAligns<EIGEN_DEFAULT_ALIGN_BYTES, EIGEN_MALLOC_ALREADY_ALIGNED>;

}  // namespace gradpsi
#endif
