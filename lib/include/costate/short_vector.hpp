/// \file
/// A vector that keeps a few elements within itself.
#pragma once

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <memory>
#include <new>
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

  ShortVector() noexcept : data_(own()) {}
  explicit ShortVector(std::size_t count) : ShortVector() { resize(count); }
  ShortVector(std::initializer_list<T> list) : ShortVector(list.begin(), list.end()) {}
  ShortVector(const std::vector<T>& list) : ShortVector(list.begin(), list.end()) {}  // NOLINT: a short vector is one
  template <std::input_iterator It>
  ShortVector(It first, It last) : ShortVector() {
    append(first, last);
  }
  ShortVector(const ShortVector& other) : ShortVector(other.begin(), other.end()) {}
  ShortVector(ShortVector&& other) noexcept : ShortVector() { take(other); }
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
  [[nodiscard]] T* data() { return data_; }
  [[nodiscard]] const T* data() const { return data_; }
  [[nodiscard]] T* begin() { return data_; }
  [[nodiscard]] T* end() { return data_ + size_; }
  [[nodiscard]] const T* begin() const { return data_; }
  [[nodiscard]] const T* end() const { return data_ + size_; }
  T& operator[](std::size_t i) { return data_[i]; }
  const T& operator[](std::size_t i) const { return data_[i]; }
  [[nodiscard]] const T& back() const { return data_[size_ - 1]; }
  [[nodiscard]] T& back() { return data_[size_ - 1]; }

  /// The element must not be one of the vector itself.
  void push_back(const T& element) {
    if (size_ == capacity_) grow(size_ + 1);
    std::construct_at(data_ + size_, element);
    ++size_;
  }
  template <class... Arguments>
  T& emplace_back(Arguments&&... arguments) {
    push_back(T(std::forward<Arguments>(arguments)...));
    return back();
  }
  void pop_back() { std::destroy_at(data_ + --size_); }
  void clear() {
    std::destroy_n(data_, size_);
    size_ = 0;
  }
  void reserve(std::size_t count) {
    if (count > capacity_) grow(count);
  }
  void resize(std::size_t count) {
    reserve(count);
    if (count < size_) {
      std::destroy(data_ + count, data_ + size_);
    } else {
      std::uninitialized_value_construct(data_ + size_, data_ + count);
    }
    size_ = count;
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
    size_ = static_cast<std::size_t>(std::uninitialized_copy(first, last, data_ + size_) - data_);
  }

 private:
  [[nodiscard]] T* own() { return reinterpret_cast<T*>(room_); }
  void release() {
    if (capacity_ > N) std::allocator<T>().deallocate(data_, capacity_);
    data_ = own();
    capacity_ = N;
  }
  void grow(std::size_t least) {
    const std::size_t capacity = std::max(least, 2 * capacity_), size = size_;
    T* const data = std::allocator<T>().allocate(capacity);
    std::uninitialized_move(begin(), end(), data);
    clear();
    release();
    data_ = data;
    size_ = size;
    capacity_ = capacity;
  }
  /// The elements of another vector; this one is empty.
  void take(ShortVector& other) noexcept {
    if (other.capacity_ > N) {
      release();
      data_ = std::exchange(other.data_, other.own());
      size_ = std::exchange(other.size_, 0);
      capacity_ = std::exchange(other.capacity_, N);
    } else {
      std::uninitialized_move(other.begin(), other.end(), data_);
      size_ = other.size_;
      other.clear();
    }
  }

  T* data_;
  std::size_t size_ = 0, capacity_ = N;
  alignas(T) std::byte room_[N * sizeof(T)];
};

}  // namespace costate
