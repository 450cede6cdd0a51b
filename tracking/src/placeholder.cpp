namespace tracking {}
