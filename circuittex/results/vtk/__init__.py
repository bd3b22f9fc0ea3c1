"""The fibrils as tubes, for ParaView."""
