"""The only place that knows batches, compilation and threads. Holds no formula."""
