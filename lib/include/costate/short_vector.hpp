/// \file
/// A vector that keeps a few elements within itself.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

namespace costate {

/// A sequence like std::vector that allocates memory only beyond N elements. Iterators end with any change of the size, and when the
/// vector is moved from.
template <class T, std::size_t N>
class ShortVector {
 public:
  using value_type = T;
  using iterator = T*;
  using const_iterator = const T*;

  ShortVector() noexcept {}  // NOLINT: its room is not to be filled
  explicit ShortVector(std::size_t count) { resize(count); }
  ShortVector(std::initializer_list<T> list) { append(list.begin(), list.end()); }
  ShortVector(const std::vector<T>& list) { append(list.begin(), list.end()); }  // NOLINT: a short vector is one
  template <std::input_iterator It>
  ShortVector(It first, It last) {
    append(first, last);
  }
  ShortVector(const ShortVector& other) { append(other.begin(), other.end()); }
  ShortVector(ShortVector&& other) noexcept { take(other); }
  ShortVector& operator=(const ShortVector& other) {
    if (this != &other) assign(other.begin(), other.end());
    return *this;
  }
  ShortVector& operator=(ShortVector&& other) noexcept {
    if (this != &other) {
      clear();
      take(other);
    }
    return *this;
  }
  ~ShortVector() {
    clear();
    release();
  }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] T* data() { return capacity_ > N ? heap_ : reinterpret_cast<T*>(room_); }
  [[nodiscard]] const T* data() const { return capacity_ > N ? heap_ : reinterpret_cast<const T*>(room_); }
  [[nodiscard]] T* begin() { return data(); }
  [[nodiscard]] T* end() { return data() + size_; }
  [[nodiscard]] const T* begin() const { return data(); }
  [[nodiscard]] const T* end() const { return data() + size_; }
  T& operator[](std::size_t i) { return data()[i]; }
  const T& operator[](std::size_t i) const { return data()[i]; }
  [[nodiscard]] const T& back() const { return data()[size_ - 1]; }
  [[nodiscard]] T& back() { return data()[size_ - 1]; }

  /// The element must not be one of the vector itself.
  void push_back(const T& element) {
    reserve(size_ + 1);
    std::construct_at(end(), element);
    ++size_;
  }
  template <class... Arguments>
  T& emplace_back(Arguments&&... arguments) {
    push_back(T(std::forward<Arguments>(arguments)...));
    return back();
  }
  void pop_back() {
    std::destroy_at(end() - 1);
    --size_;
  }
  void clear() {
    std::destroy_n(data(), size_);
    size_ = 0;
  }
  void reserve(std::size_t count) {
    if (count > capacity_) grow(count);
  }
  void resize(std::size_t count) {
    reserve(count);
    if (count < size_) {
      std::destroy(data() + count, end());
    } else {
      std::uninitialized_value_construct(end(), data() + count);
    }
    size_ = static_cast<std::uint32_t>(count);
  }
  /// Elements of another sequence, instead of these or behind them.
  template <std::input_iterator It>
  void assign(It first, It last) {
    clear();
    append(first, last);
  }
  template <std::input_iterator It>
  void append(It first, It last) {
    reserve(size_ + static_cast<std::size_t>(std::distance(first, last)));
    std::uninitialized_copy(first, last, end());
    size_ += static_cast<std::uint32_t>(std::distance(first, last));
  }
  /// Room for plain elements behind these, to be written by the caller.
  [[nodiscard]] T* extend(std::size_t count) requires std::is_trivially_copyable_v<T> {
    reserve(size_ + count);
    size_ += static_cast<std::uint32_t>(count);
    return end() - count;
  }

 private:
  void release() {
    if (capacity_ > N) std::allocator<T>().deallocate(heap_, capacity_);
    capacity_ = N;
  }
  void grow(std::size_t least) {
    const std::size_t capacity = std::max<std::size_t>(least, 2 * capacity_);
    const std::uint32_t size = size_;
    T* const heap = std::allocator<T>().allocate(capacity);
    std::uninitialized_move(begin(), end(), heap);
    clear();
    release();
    heap_ = heap;
    size_ = size;
    capacity_ = static_cast<std::uint32_t>(capacity);
  }
  /// The elements of another vector; this one is empty.
  void take(ShortVector& other) noexcept {
    if (other.capacity_ > N) {
      release();
      heap_ = other.heap_;
      size_ = std::exchange(other.size_, 0);
      capacity_ = std::exchange(other.capacity_, N);
    } else {
      std::uninitialized_move(other.begin(), other.end(), data());
      size_ = other.size_;
      other.clear();
    }
  }

  std::uint32_t size_ = 0, capacity_ = N;
  union {
    T* heap_;                                   ///< where the capacity is above N
    alignas(T) std::byte room_[N * sizeof(T)];  ///< else
  };
};

}  // namespace costate
