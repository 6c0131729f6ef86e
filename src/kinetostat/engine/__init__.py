"""The only place that knows batches, compilation, threads and devices. Holds no formula."""
