"""A second, independent implementation of the test-bed, on MuJoCo's rigid-body dynamics."""
