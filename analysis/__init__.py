"""What a coupled pair does: runs in time, frequency responses, random response, comfort."""
